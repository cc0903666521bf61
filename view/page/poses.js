// Taught poses: named, kept by the browser for each robot, reached by holding a button.

import { axes } from './readout.js';

const get = (id) => document.getElementById(id);

/** Numbers of a program, without digits that say nothing. */
const short = (value, digits) => String(Number(value.toFixed(digits)));

/** A pose as programs write it: point in mm, z axis, x axis. */
export function written({ point, turn }) {
  const { z, x } = axes(turn);
  const list = (values, digits) => `{${values.map((value) => short(value, digits)).join(', ')}}`;
  return `{${list(point.map((value) => value * 1000), 3)}, ${list(z, 9)}, ${list(x, 9)}}`;
}

export class Poses {
  /** `act` has now(), program, pendant, ghost(joints or null), tell(text). */
  constructor(act) {
    this.act = act;
    this.key = null;
    this.list = [];
    get('pose-form').addEventListener('submit', (event) => { event.preventDefault(); this.save(); });
    get('teach').addEventListener('click', () => this.insert(act.now()));
    get('replace').addEventListener('click', () => this.replace(act.now()));
  }

  setRobot(robot) {
    this.key = `canter poses ${robot.name}`;
    let kept = [];
    try { kept = JSON.parse(localStorage.getItem(this.key)) || []; } catch { /* what cannot be read is no list */ }
    this.list = kept.filter((pose) => Array.isArray(pose.joints) && pose.joints.length === robot.joints.length);
    this.draw();
  }

  /** Keeps where the arm is under a name; a known name gets the new place. */
  save() {
    const now = this.act.now();
    if (!now || !this.key) return;
    const name = get('pose-name').value.trim() || `pose ${this.list.length + 1}`;
    this.list = this.list.filter((pose) => pose.name !== name);
    this.list.push({ name, ...now });
    get('pose-name').value = '';
    this.keep();
  }

  keep() {
    localStorage.setItem(this.key, JSON.stringify(this.list));
    this.draw();
  }

  insert(pose) {
    if (pose) this.act.program.insert(`MoveTo(${written(pose)})${pose.name ? `  // ${pose.name}` : ''}`);
  }

  /** Puts where the arm is into the line of the cursor. */
  replace(pose) {
    if (pose && !this.act.program.replacePose(written(pose))) this.act.tell('The line of the cursor has no pose.');
  }

  draw() {
    get('poses').replaceChildren(...this.list.map((pose) => this.row(pose)));
    get('no-poses').hidden = this.list.length > 0;
    this.act.pendant.show();
  }

  row(pose) {
    const item = document.createElement('li');
    const name = document.createElement('span');
    name.className = 'grow';
    name.textContent = pose.name;
    const button = (text, label, act) => {
      const made = document.createElement('button');
      made.textContent = text;
      made.setAttribute('aria-label', `${pose.name}: ${label}`);
      made.title = label;
      if (act) made.addEventListener('click', act);
      return made;
    };
    const go = button('Go', 'hold to move there; the arm stops when you let go');
    go.dataset.go = pose.name;
    this.act.pendant.holds(go, () => ({ goal: pose.joints }));
    const insert = button('Insert', 'insert a MoveTo into the program', () => this.insert(pose));
    const drop = button('\u00d7', 'forget', () => { this.list = this.list.filter((other) => other !== pose); this.keep(); });
    drop.className = 'quiet';
    for (const [event, joints] of [['pointerenter', pose.joints], ['focusin', pose.joints], ['pointerleave', null], ['focusout', null]]) {
      item.addEventListener(event, () => this.act.ghost(joints));
    }
    item.append(name, go, insert, drop);
    return item;
  }
}
