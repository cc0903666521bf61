// The pendant: moving by hand. A jog lives from beat to beat and ends with the first doubt.

import { digits, inFrame, rollPitchYaw } from './readout.js';

const BEAT_MS = 50;
/** How long a beat may stay without an answer: then the link, the view or the engine stands still. */
const ANSWER_MS = 400;
/** How many beats may be under way at once: what waits behind others arrives old. */
const UNDER_WAY = 2;
const AXES = ['X', 'Y', 'Z', 'RX', 'RY', 'RZ'];
const get = (id) => document.getElementById(id);
const radians = (degrees) => degrees * Math.PI / 180;

export class Pendant {
  /** `act` has link, ask(wish), tell(text). */
  constructor(act) {
    this.act = act;
    this.page = 0;
    this.mayMove = false;
    this.holder = 0;
    this.space = 'joint';
    this.joints = 0;
    this.robot = null;
    /** What is held: axis and direction or a goal, button, and how: 'pointer', 'key' or 'gamepad'. */
    this.held = null;
    /** When the beats were sent that have no answer yet (ms). */
    this.open = new Set();
    this.beats = 0;
    this.ended = null;
    get('hand').addEventListener('click', () => this.takeOrLeave());
    for (const button of document.querySelectorAll('[data-space]')) {
      button.addEventListener('click', () => this.mode(button.dataset.space));
    }
    get('step').addEventListener('change', () => this.end('another step'));
    get('jog-speed').addEventListener('input', (event) => { get('jog-speed-value').textContent = `${event.target.value} %`; });
    this.watch();
    this.show();
  }

  /** Every way in which a page can lose whoever holds a button. */
  watch() {
    const end = (why) => () => this.end(why);
    addEventListener('blur', end('the window lost the focus'));
    addEventListener('pagehide', end('the page was left'));
    addEventListener('contextmenu', end('a menu came'));
    document.addEventListener('freeze', end('the tab is frozen'));
    document.addEventListener('visibilitychange', () => { if (document.hidden) this.end('the tab is hidden'); });
    addEventListener('pointerup', (event) => this.pointerGone(event, 'released'));
    addEventListener('pointercancel', (event) => this.pointerGone(event, 'the pointer was lost'));
    addEventListener('keyup', (event) => { if (this.held?.how === 'key' && event.code === this.held.code) this.end('released'); });
  }

  pointerGone(event, why) {
    if (this.held?.how === 'pointer' && event.pointerId === this.held.pointer) this.end(why);
  }

  setRobot(robot) { this.end('another robot'); this.robot = robot; this.joints = robot.joints.length; this.build(); }

  hello({ page, may_move: mayMove }) { this.end('a new connection'); this.page = page; this.mayMove = mayMove; this.show(); }

  setHolder(page) {
    this.holder = page;
    if (!this.has) this.end('the hand is gone');
    this.show();
  }

  get has() { return this.holder !== 0 && this.holder === this.page; }

  async takeOrLeave() {
    const answer = await this.act.ask({ do: this.has ? 'release' : 'take' });
    if (!answer.ok) this.act.tell(answer.message);
  }

  mode(space) {
    // A key or finger that is still down must not move another axis.
    this.end('another mode');
    this.space = space;
    this.build();
  }

  build() {
    for (const button of document.querySelectorAll('[data-space]')) {
      button.setAttribute('aria-checked', String(button.dataset.space === this.space));
    }
    const names = this.space === 'joint' ? Array.from({ length: this.joints }, (_, k) => `J${k + 1}`) : AXES;
    get('axes').replaceChildren(...names.map((name, index) => this.axis(name, index)));
    this.show();
  }

  axis(name, index) {
    const line = document.createElement('div');
    line.className = 'axis';
    const value = document.createElement('output');
    value.className = 'num';
    value.dataset.axis = index;
    value.textContent = name;
    line.append(this.button(index, -1, name), value, this.button(index, 1, name));
    return line;
  }

  button(index, direction, name) {
    const button = document.createElement('button');
    const word = direction < 0 ? 'minus' : 'plus';
    button.textContent = direction < 0 ? '\u2212' : '+';
    button.setAttribute('aria-label', `${name} ${word}, hold to move`);
    button.dataset.jog = `${index}:${direction}`;
    this.holds(button, () => ({ index, direction }));
    return button;
  }

  /** Makes a button move the arm while it is held: by pointer, by space bar or by enter. */
  holds(button, what) {
    button.addEventListener('pointerdown', (event) => {
      if (event.button !== 0 || button.disabled) return;
      event.preventDefault();
      button.focus({ preventScroll: true });
      button.setPointerCapture(event.pointerId);
      this.begin({ ...what(), button, how: 'pointer', pointer: event.pointerId });
    });
    button.addEventListener('lostpointercapture', (event) => this.pointerGone(event, 'the pointer was lost'));
    button.addEventListener('keydown', (event) => {
      if (event.code !== 'Space' && event.code !== 'Enter') return;
      event.preventDefault();
      if (!event.repeat) this.begin({ ...what(), button, how: 'key', code: event.code });
    });
    button.addEventListener('blur', () => { if (this.held?.button === button) this.end('the button lost the focus'); });
  }

  begin(what) {
    this.end('another axis');
    if (!this.has) { this.act.tell('Take the hand first.'); return; }
    const length = Number(get('step').value);
    if (length > 0 && !what.goal) { this.stepOnce(what, length); return; }
    this.held = what;
    this.ended = null;
    this.open.clear();
    what.button?.classList.add('held');
    this.beat();
    this.timer = setInterval(() => this.beat(), BEAT_MS);
  }

  /** Speeds of the axis that is held, and whether it turns. */
  speeds({ index, direction }) {
    const list = new Array(this.space === 'joint' ? this.joints : 6).fill(0);
    list[index] = direction * Number(get('jog-speed').value) / 100;
    return list;
  }

  turns(index) { return this.space === 'joint' ? !this.robot.slides[index] : index > 2; }

  /** One step of mm or degrees: it ends by itself. */
  async stepOnce(what, length) {
    const distance = this.turns(what.index) ? radians(length) : length / 1000;
    const wish = { do: 'step', space: this.space, speeds: this.speeds(what), distance, sent_ms: performance.now() };
    const answer = await this.act.ask(wish);
    if (!answer.ok) this.act.tell(answer.message);
  }

  wish(held) {
    const sent = performance.now();
    if (!held.goal) return { do: 'jog', space: this.space, speeds: this.speeds(held), sent_ms: sent };
    return { do: 'jog', space: 'goal', speeds: [Number(get('jog-speed').value) / 100], goal: held.goal, sent_ms: sent };
  }

  async beat() {
    const held = this.held;
    if (!held) return;
    // What does not leave, or is not answered, would arrive late and all at once.
    const late = [...this.open].some((sent) => performance.now() - sent > ANSWER_MS);
    if (this.act.link.stalled > 0 || late) { this.end('the link stands still'); return; }
    if (this.open.size >= UNDER_WAY) return;
    const wish = this.wish(held);
    this.beats += 1;
    this.open.add(wish.sent_ms);
    const answer = await this.act.ask(wish);
    this.open.delete(wish.sent_ms);
    if (!answer.ok && this.held === held) { this.end('refused'); this.act.tell(answer.message); }
  }

  end(why) {
    if (!this.held) return;
    clearInterval(this.timer);
    this.held.button?.classList.remove('held');
    this.held = null;
    this.ended = why;
    // Where it cannot be sent, the engine hears no beat and stops by itself.
    this.act.ask({ do: 'jog', space: 'tool', speeds: new Array(6).fill(0), sent_ms: performance.now() });
  }

  show() {
    const { has } = this;
    const ids = ['pause', 'resume', 'abort', 'recover', 'override', 'run', 'step-on', 'grip-open', 'grip-close'];
    for (const id of ids) get(id).disabled = !has;
    get('pause').disabled = !this.page;
    for (const button of document.querySelectorAll('[data-jog], [data-go]')) button.disabled = !has;
    get('hand').disabled = !this.mayMove || (this.holder !== 0 && !has);
    get('hand').textContent = has ? 'Let go' : 'Take the hand';
    get('hand').classList.toggle('go', !has && this.mayMove);
    const state = has ? 'you have it' : (this.holder !== 0 ? 'another page has it' : '');
    get('hand-state').textContent = this.mayMove ? state : 'watching';
  }

  /** Shows where the axes are: joints (rad or m), point (m) and turn (w, x, y, z) of the tool. */
  values(joints, point, turn) {
    const list = this.space === 'joint' ? joints : this.place(point, turn);
    for (const output of document.querySelectorAll('output[data-axis]')) {
      const index = Number(output.dataset.axis);
      const name = this.space === 'joint' ? `J${index + 1}` : AXES[index];
      // Along its own axes a tool is nowhere.
      if (list === null) { output.textContent = name; continue; }
      const text = this.turns(index) ? `${digits(list[index] * 180 / Math.PI, 2)}\u00b0` : `${digits(list[index] * 1000, 1)} mm`;
      if (output.childNodes.length < 2) output.replaceChildren(document.createTextNode(''), document.createElement('small'));
      output.firstChild.nodeValue = text;
      output.lastChild.textContent = name;
    }
  }

  /** The tool in the axes that are chosen; null in its own. */
  place(point, turn) {
    if (this.space === 'tool') return null;
    const frame = this.space === 'base' ? this.robot.workstation_from_base : [0, 0, 0, 1, 0, 0, 0];
    const seen = inFrame(point, turn, frame);
    return [...seen.point, ...rollPitchYaw(seen.turn)];
  }
}
