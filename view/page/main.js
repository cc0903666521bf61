// Puts the page together.

import { drawRamp, JOINTS } from './colours.js';
import { Link } from './link.js';
import { Pendant } from './pendant.js';
import { Player } from './player.js';
import { Plots } from './plots.js';
import { Program } from './program.js';
import { axes, Readout, rollPitchYaw } from './readout.js';
import { COMMAND, PATH_TIME, POINT, Samples } from './samples.js';
import { Stage } from './scene.js';

const get = (id) => document.getElementById(id);
const samples = new Samples();
let robot = null;
let status = null;
let replay = false;
let dry = false;
let drawnRow = -1;
let command = null;

// Dark or light: as the system says, until somebody chooses.
const wanted = localStorage.getItem('canter theme') || (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');
document.documentElement.dataset.theme = wanted;

const stage = new Stage(get('view'));
const plots = new Plots(get('plot'), samples);
const readout = new Readout();
const act = {
  link: null,
  ask: (wish) => act.link.ask(wish),
  tell: (text) => readout.tell(text),
  joints: () => (status && status.idle !== false ? status.setpoint : null),
};
const program = new Program(act);
const pendant = new Pendant(act);
const player = new Player(act.ask);

function setRobot(about) {
  robot = about;
  get('robot-name').textContent = about.name;
  get('robot-name').title = about.description;
  get('arm-name').textContent = about.arm;
  get('legend-most').textContent = `${about.tool.speed} m/s`;
  stage.setRobot(about);
  plots.setRobot(about);
  readout.setRobot(about);
  pendant.setRobot(about);
  get('quantities').replaceChildren(...plots.all.map((quantity, index) => {
    const button = document.createElement('button');
    button.setAttribute('role', 'radio');
    button.textContent = quantity.title;
    button.addEventListener('click', () => choose(index));
    return button;
  }));
  choose(plots.chosen);
}

function choose(index) {
  plots.choose(index);
  for (const [at, button] of [...get('quantities').children].entries()) button.setAttribute('aria-checked', String(at === index));
  keys(plots.all[index].lines);
}

function keys(texts) {
  get('keys').replaceChildren(...texts.map((text, k) => {
    const key = document.createElement('span');
    key.textContent = text;
    key.style.setProperty('--mark', JOINTS[k % JOINTS.length]);
    return key;
  }));
}
plots.onvalues = keys;
plots.onfreeze = (frozen) => get('freeze').setAttribute('aria-pressed', String(frozen));

/** The state in a word, and its kind. */
function stateOf(message) {
  const now = message.status;
  if (!message.engine) return ['no engine', 'off'];
  if (message.replay) return [message.replay.plays ? 'replay' : 'replay, standing', 'off'];
  if (message.dry) return ['preview, nothing moves', 'off'];
  if (now.fault) return [now.fault, 'fault'];
  if (now.held) return [now.time_scaling > 0 ? 'stopping' : 'held', 'held'];
  if (now.command === 'jog') return ['moved by hand', 'moves'];
  if (!now.idle) return [now.command || 'running', 'moves'];
  return ['idle', 'idle'];
}

function setStatus(message) {
  status = message.status || null;
  replay = Boolean(message.replay);
  dry = Boolean(message.dry);
  const [text, kind] = stateOf(message);
  get('state').textContent = text;
  get('state').title = text;
  get('state').dataset.kind = kind;
  get('recover').hidden = kind !== 'fault';
  get('resume').hidden = kind !== 'held';
  get('pause').hidden = kind === 'held';
  // What stands still for ever has nothing to stop.
  document.body.dataset.live = replay || dry ? 'no' : 'yes';
  notice(message.engine ? '' : message.reason);
  if (message.replay) player.set(message.replay);
  if (!status || !robot) return;
  readout.joints(status.joints);
  if (status.position_m) {
    const angles = rollPitchYaw(status.orientation_wxyz);
    readout.pose(status.position_m, angles);
    pendant.values(status.joints, [...status.position_m, ...angles]);
  }
  if (samples.count === 0) stage.setJoints(status.joints);
}

function notice(text) {
  get('notice').textContent = text || '';
  get('notice').hidden = !text;
}

const handlers = {
  hello: (message) => { pendant.hello(message); get('pendant').hidden = message.replay; notice(''); },
  robot: (message) => setRobot(message.robot),
  status: setStatus,
  program: (message) => program.given(message.program),
  preview: (message) => { program.planned(message); stage.setPlan(message.ok ? message : null); },
  notes: (message) => readout.notes(message.notes),
  hand: (message) => pendant.setHolder(message.page),
};

act.link = new Link({
  text: (message) => handlers[message.is]?.(message),
  block: (buffer) => {
    if (samples.take(buffer)) { stage.clearTrail(); drawnRow = -1; }
    plots.dirty = true;
  },
  open: () => notice(''),
  closed: (reason) => {
    pendant.end('the connection is lost');
    pendant.hello({ page: 0, may_move: false });
    get('state').textContent = 'no connection';
    get('state').dataset.kind = 'fault';
    notice(reason);
  },
});

/** Takes the new rows into picture and program. */
function follow() {
  const last = samples.dropped + samples.count - 1;
  if (last <= drawnRow || samples.count === 0) return;
  const from = Math.max(drawnRow + 1 - samples.dropped, 0);
  // A few points a picture are enough for the path travelled.
  const step = Math.max(1, Math.min(8, Math.floor((samples.count - from) / 4)));
  for (let row = from; row < samples.count; row += step) {
    const point = [samples.at(row, POINT), samples.at(row, POINT + 1), samples.at(row, POINT + 2)];
    stage.travel(point, samples.tick(row), samples.period);
  }
  drawnRow = last;
  const newest = samples.count - 1;
  stage.setJoints(samples.newestJoints(true));
  const time = samples.at(newest, PATH_TIME);
  command = program.at(samples.at(newest, COMMAND), time);
  if (command) stage.cross(command.index, time);
  progress(time);
}

function progress(time) {
  const plan = program.plan;
  const active = command && plan && (replay || (status && !status.idle));
  get('progress-bar').style.width = active ? `${Math.min((command.start_s + time) / plan.duration_s, 1) * 100}%` : '0';
  get('time').textContent = active ? `${(command.start_s + time).toFixed(1)} / ${plan.duration_s.toFixed(1)} s` : '';
  get('command').textContent = active ? command.name : '';
}

function frame() {
  if (!document.hidden) {
    follow();
    stage.draw();
    plots.draw();
  }
  requestAnimationFrame(frame);
}

async function order(wish) {
  const answer = await act.ask(wish);
  if (!answer.ok) act.tell(answer.message);
}

get('stop').addEventListener('click', () => { pendant.end('stopped'); order({ do: 'stop', fast: false }); });
get('pause').addEventListener('click', () => order({ do: 'pause' }));
get('resume').addEventListener('click', () => order({ do: 'resume' }));
get('abort').addEventListener('click', () => order({ do: 'abort' }));
get('recover').addEventListener('click', () => order({ do: 'recover' }));
get('override').addEventListener('input', (event) => {
  get('override-value').textContent = `${event.target.value} %`;
  order({ do: 'override', share: Number(event.target.value) / 100 });
});
get('theme').addEventListener('click', () => {
  const next = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
  document.documentElement.dataset.theme = next;
  localStorage.setItem('canter theme', next);
  stage.theme();
  plots.dirty = true;
});
get('freeze').addEventListener('click', () => plots.freeze(!plots.frozen));
get('copy').addEventListener('click', async () => {
  try {
    await navigator.clipboard.writeText(plots.csv());
    act.tell('Copied as CSV.');
  } catch {
    act.tell('The browser does not let this page copy.');
  }
});
for (const button of document.querySelectorAll('[data-camera]')) button.addEventListener('click', () => stage.look(button.dataset.camera));
for (const box of document.querySelectorAll('[data-layer]')) box.addEventListener('change', () => stage.show(box.dataset.layer, box.checked));
get('view').addEventListener('keydown', (event) => {
  const name = ['iso', 'front', 'side', 'top'][Number(event.key) - 1];
  if (name) stage.look(name);
});
get('view').addEventListener('pointermove', (event) => {
  const found = stage.under(event.offsetX, event.offsetY);
  const planned = found && program.plan && program.plan.commands.find((entry) => entry.index === found.command);
  get('hint').hidden = !found;
  if (!found) return;
  const place = found.point.map((value) => (value * 1000).toFixed(1)).join(', ');
  get('hint').textContent = `${place} mm at ${found.time.toFixed(2)} s, ${(found.speed * 1000).toFixed(0)} mm/s${planned ? `, line ${planned.line} ${planned.name}` : ''}`;
});
addEventListener('keydown', (event) => {
  if (event.key === 'Escape') { pendant.end('stopped'); order({ do: 'stop', fast: false }); }
});

/** Numbers of a program, without digits that say nothing. */
const short = (value, digits) => String(Number(value.toFixed(digits)));
get('teach').addEventListener('click', () => {
  if (!status || !status.position_m) return;
  const { z, x } = axes(status.orientation_wxyz);
  const list = (values, digits) => `{${values.map((value) => short(value, digits)).join(', ')}}`;
  const point = status.position_m.map((value) => value * 1000);
  program.insert(`MoveTo({${list(point, 3)}, ${list(z, 9)}, ${list(x, 9)}})`);
});
const grip = (call) => async () => {
  const ready = status && status.state === 'ready';
  await order({ do: 'run', name: 'pendant', program: `${ready ? '' : 'InitCanon()\n'}${call}()\n` });
};
get('grip-open').addEventListener('click', grip('OpenGripper'));
get('grip-close').addEventListener('click', grip('CloseGripper'));

drawRamp(get('legend'));
requestAnimationFrame(frame);

// What tests look at.
window.__view = { act, samples, stage, plots, pendant, program, get status() { return status; }, get robot() { return robot; }, get dry() { return dry; } };
