// The pendant: moving by hand. A jog lives from beat to beat and ends with the first doubt.

const BEAT_MS = 50;
const AXES = ['X', 'Y', 'Z', 'RX', 'RY', 'RZ'];
const get = (id) => document.getElementById(id);

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
    /** What is held: axis, direction, button, and how: 'pointer' or 'key'. */
    this.held = null;
    this.beats = 0;
    this.ended = null;
    get('hand').addEventListener('click', () => this.takeOrLeave());
    for (const button of document.querySelectorAll('[data-space]')) {
      button.addEventListener('click', () => this.mode(button.dataset.space));
    }
    get('jog-speed').addEventListener('input', (event) => { get('jog-speed-value').textContent = `${event.target.value} %`; });
    // Every way in which a page can lose whoever holds a button.
    const end = (why) => () => this.end(why);
    addEventListener('blur', end('the window lost the focus'));
    addEventListener('pagehide', end('the page was left'));
    addEventListener('contextmenu', end('a menu came'));
    document.addEventListener('visibilitychange', () => { if (document.hidden) this.end('the tab is hidden'); });
    addEventListener('pointerup', (event) => this.pointerGone(event, 'released'));
    addEventListener('pointercancel', (event) => this.pointerGone(event, 'the pointer was lost'));
    addEventListener('keyup', (event) => { if (this.held?.how === 'key' && event.code === this.held.code) this.end('released'); });
    this.show();
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
    button.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      button.focus({ preventScroll: true });
      button.setPointerCapture(event.pointerId);
      this.begin({ index, direction, button, how: 'pointer', pointer: event.pointerId });
    });
    button.addEventListener('lostpointercapture', (event) => this.pointerGone(event, 'the pointer was lost'));
    button.addEventListener('keydown', (event) => {
      if (event.code !== 'Space' && event.code !== 'Enter') return;
      event.preventDefault();
      if (!event.repeat) this.begin({ index, direction, button, how: 'key', code: event.code });
    });
    button.addEventListener('blur', () => { if (this.held?.button === button) this.end('the button lost the focus'); });
    return button;
  }

  begin(what) {
    this.end('another axis');
    if (!this.has) { this.act.tell('Take the hand first.'); return; }
    this.held = what;
    this.ended = null;
    what.button.classList.add('held');
    this.beat();
    this.timer = setInterval(() => this.beat(), BEAT_MS);
  }

  async beat() {
    const held = this.held;
    if (!held) return;
    // Bytes that do not leave would arrive late and all at once.
    if (this.act.link.stalled > 0) { this.end('the link stands still'); return; }
    const speeds = new Array(this.space === 'joint' ? this.joints : 6).fill(0);
    speeds[held.index] = held.direction * Number(get('jog-speed').value) / 100;
    this.beats += 1;
    const answer = await this.act.ask({ do: 'jog', space: this.space, speeds });
    if (!answer.ok && this.held === held) { this.end('refused'); this.act.tell(answer.message); }
  }

  end(why) {
    if (!this.held) return;
    clearInterval(this.timer);
    this.held.button.classList.remove('held');
    this.held = null;
    this.ended = why;
    // Where it cannot be sent, the engine hears no beat and stops by itself.
    this.act.ask({ do: 'jog', space: this.space, speeds: new Array(this.space === 'joint' ? this.joints : 6).fill(0) });
  }

  show() {
    const { has } = this;
    for (const id of ['pause', 'resume', 'abort', 'recover', 'override', 'run', 'grip-open', 'grip-close']) get(id).disabled = !has;
    get('pause').disabled = !this.page;
    for (const button of document.querySelectorAll('[data-jog]')) button.disabled = !has;
    get('hand').disabled = !this.mayMove || (this.holder !== 0 && !has);
    get('hand').textContent = has ? 'Let go' : 'Take the hand';
    get('hand').classList.toggle('go', !has && this.mayMove);
    const state = has ? 'you have the hand' : (this.holder !== 0 ? 'another page has it' : '');
    get('hand-state').textContent = this.mayMove ? state : 'watching';
  }

  /** Shows where the axes are: joints (rad or m), point (m), turn (rad). */
  values(joints, pose) {
    for (const output of document.querySelectorAll('output[data-axis]')) {
      const index = Number(output.dataset.axis);
      const [text, unit] = this.space === 'joint' ? jointText(this.robot, joints, index) : poseText(pose, index);
      const name = this.space === 'joint' ? `J${index + 1}` : AXES[index];
      output.firstChild.nodeValue = `${text} ${unit}`;
      if (output.childNodes.length < 2) output.append(document.createElement('small'));
      output.lastChild.textContent = name;
    }
  }
}

function jointText(robot, joints, index) {
  const slides = robot && robot.slides && robot.slides[index];
  return slides ? [(joints[index] * 1000).toFixed(1), 'mm'] : [(joints[index] * 180 / Math.PI).toFixed(2), '\u00b0'];
}

function poseText(pose, index) {
  return index < 3 ? [(pose[index] * 1000).toFixed(1), 'mm'] : [(pose[index] * 180 / Math.PI).toFixed(2), '\u00b0'];
}
