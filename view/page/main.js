// Puts the page together.

import { drawRamp, JOINTS } from './colours.js';
import { Gamepads } from './gamepad.js';
import { Header } from './header.js';
import { Link, token } from './link.js';
import { Lists } from './lists.js';
import { Measure } from './measure.js';
import { Meshes } from './mesh.js';
import { Pendant } from './pendant.js';
import { Player } from './player.js';
import { Plots } from './plots.js';
import { Poses } from './poses.js';
import { Program } from './program.js';
import { Queue } from './queue.js';
import { Readout, rollPitchYaw } from './readout.js';
import { COMMAND, PATH_TIME, POINT, Samples } from './samples.js';
import { Stage } from './scene.js';
import { Tabs } from './tabs.js';
import { WorldObjects } from './world.js';

const get = (id) => document.getElementById(id);
const samples = new Samples();
let robot = null;
let status = null;
let replay = false;
let dry = false;
let drawnRow = -1;
let opened = 0;
let command = null;

// Dark or light: as the system says, until somebody chooses.
const wanted = localStorage.getItem('canter theme') || (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');
document.documentElement.dataset.theme = wanted;

const readout = new Readout();
const tabs = new Tabs(get('tabs'));
const lost = (name) => readout.tell(`The mesh ${name} cannot be read: the arm is shown without it.`);
const stage = new Stage(get('view'), new Meshes(token(), lost));
const plots = new Plots(get('plot'), samples);
const world = new WorldObjects(stage);
const act = {
  link: null,
  ask: (wish) => act.link.ask(wish),
  tell: (text) => readout.tell(text),
  joints: () => (status && status.idle !== false ? status.setpoint : null),
  status: () => status,
};
const program = new Program(act);
const pendant = new Pendant(act);
const gamepads = new Gamepads(pendant);
const header = new Header(order, () => pendant.end('stopped'));
const player = new Player(act.ask, (time) => showPlanned(time));
const queue = new Queue(program);
const lists = new Lists(act.ask);
const measure = new Measure(stage, (text) => hint(text));
const poses = new Poses({
  program,
  pendant,
  tell: act.tell,
  ghost: (joints) => stage.showPose(joints),
  /** Where the arm is: joints, point (m) and turn (w, x, y, z) of the tool. */
  now: () => (status && status.position_m ? { joints: status.setpoint, point: status.position_m, turn: status.orientation_wxyz } : null),
});

// What is hidden does not scroll.
tabs.onshow = (name) => { if (name === 'messages') get('notes').scrollTop = get('notes').scrollHeight; };

/** A text over the picture, until there is another. */
function hint(text) {
  get('hint').hidden = !text;
  get('hint').textContent = text || '';
}

let saidUntil = 0;
readout.onnote = (text, kind) => {
  tabs.mark('messages', kind);
  // What went wrong stays until something else is said.
  if (kind === '' && get('said').dataset.kind === 'bad') return;
  // Of a recording all notes come at once.
  if (replay || dry) return;
  get('said').textContent = text;
  get('said').dataset.kind = kind;
  get('said').hidden = false;
  saidUntil = kind === 'bad' ? Infinity : performance.now() + 6000;
};

function setRobot(about) {
  robot = about;
  header.setRobot(about);
  get('legend-most').textContent = `${about.tool.speed} m/s`;
  stage.setRobot(about);
  plots.setRobot(about);
  readout.setRobot(about);
  pendant.setRobot(about);
  poses.setRobot(about);
  offer();
}

/** Buttons for what can be plotted. */
function offer() {
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

function setStatus(message) {
  status = message.status || null;
  replay = Boolean(message.replay);
  dry = Boolean(message.dry);
  header.set(message);
  notice(message.engine ? '' : message.reason);
  if (message.replay) player.set(message.replay);
  if (!status || !robot) return;
  if (!player.here) readout.joints(status.joints);
  if (status.position_m) {
    const angles = rollPitchYaw(status.orientation_wxyz);
    readout.pose(status.position_m, angles);
    pendant.values(status.joints, status.position_m, status.orientation_wxyz);
  }
  if (samples.count === 0 && !player.here) stage.setJoints(status.joints);
}

/** Nothing runs: plots and time controls are those of the plan. */
function setPlan(plan) {
  if (!robot) {
    document.body.dataset.bare = 'yes';
    get('robot-name').textContent = 'a tool without an arm';
    plots.setTool(plan.speed_m_s);
    stage.most = plan.speed_m_s;
    get('legend-most').textContent = `${Number(plan.speed_m_s.toFixed(3))} m/s`;
    stage.setPlan(plan);
    stage.frameOn(plan.path.points);
  }
  samples.fill(plan, robot ? robot.joints.length : 0);
  plots.setPlan(plan.duration_s);
  offer();
  player.setPlan(plan.duration_s);
}

/** What stands in the workstation, and the plan that is executed there. */
function setWorld(about) {
  world.set(about);
  get('objects-layer').hidden = false;
  get('plan-now').hidden = !about.plan;
  get('plan-now').textContent = about.plan || '';
  // A plan gives its commands one by one: there is no program.
  if (about.plan) get('text').placeholder = about.plan;
}

function notice(text) {
  get('notice').textContent = text || '';
  get('notice').hidden = !text;
}

const handlers = {
  hello: (message) => { pendant.hello(message); get('pendant').hidden = message.replay; notice(''); },
  robot: (message) => setRobot(message.robot),
  status: setStatus,
  world: (message) => setWorld(message.world),
  program: (message) => program.given(message.program),
  lists: (message) => lists.set(message),
  preview: (message) => {
    program.planned(message);
    stage.setPlan(message.ok ? message : null);
    if (dry && message.ok) setPlan(message);
  },
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
    header.state('no connection', 'fault');
    notice(reason);
  },
});

/** Takes the new rows into picture and program. */
function follow() {
  const last = samples.dropped + samples.count - 1;
  if (dry || last <= drawnRow || samples.count === 0) return;
  const from = Math.max(drawnRow + 1 - samples.dropped, 0);
  // A few points a picture are enough for the path travelled.
  const step = Math.max(1, Math.min(8, Math.floor((samples.count - from) / 4)));
  for (let row = from; row < samples.count; row += step) {
    const point = [samples.at(row, POINT), samples.at(row, POINT + 1), samples.at(row, POINT + 2)];
    stage.travel(point, samples.tick(row), samples.period);
  }
  drawnRow = last;
  const newest = samples.count - 1;
  if (!plots.frozen) stage.setJoints(samples.newestJoints(true));
  const time = samples.at(newest, PATH_TIME);
  command = program.at(samples.at(newest, COMMAND), time);
  if (command) stage.cross(command.index, time);
  progress(time);
}

/** Shows the arm at a time of a plan that is played here. */
function showPlanned(time) {
  const { plan } = program;
  if (!plan || plan.path.points.length === 0) return;
  const row = Math.min(Math.round(time / plan.path.step_s), plan.path.points.length - 1);
  if (robot) {
    const joints = plan.path.joints[row];
    stage.setJoints(joints);
    readout.joints(joints);
    readout.pose(plan.path.points[row], rollPitchYaw(stage.robot.turn()));
  } else {
    stage.showPoint(plan.path.points[row]);
  }
  plots.mark = time;
  plots.dirty = true;
  const now = plan.commands.findLast((found) => found.start_s <= time);
  if (now) {
    program.show(now, time - now.start_s);
    stage.cross(now.index, time - now.start_s);
  }
  header.progress(time, plan.duration_s);
}

/** While the plots are frozen, the picture shows the arm as it was then, and says so. */
let lookedAt = null;
function lookBack() {
  const row = plots.lookedAt();
  if (row === lookedAt) return;
  lookedAt = row;
  const newest = samples.count - 1;
  get('past').hidden = row === null;
  if (newest < 0) return;
  stage.setJoints(samples.jointsAt(row ?? newest, true));
  if (row === null) return;
  const ago = (samples.tick(newest) - samples.tick(row)) * samples.period;
  get('past').textContent = `The past: ${ago.toFixed(2)} s ago. The arm has moved on.`;
}

function progress(time) {
  const plan = program.plan;
  const active = command && plan && (replay || (status && !status.idle));
  // A recording has its own time controls.
  if (!replay) header.progress(active ? command.start_s + time : null, plan?.duration_s);
  queue.set(active ? command : null, time, replay ? null : status);
}

function frame() {
  gamepads.look();
  if (!document.hidden) {
    follow();
    lookBack();
    player.turn();
    if (performance.now() > saidUntil) get('said').hidden = true;
    // An empty picture is not worth the time that the first one takes; without an engine it comes.
    if (robot || dry || performance.now() > 3000) stage.draw();
    // With the arm the page is open: how long that took (ms).
    if (!opened && robot && stage.frames > 0) opened = performance.now();
    plots.draw();
    tellLosses();
  }
  requestAnimationFrame(frame);
}

/** How many periods did not get here, and how many there never were. */
let toldLosses = '';
function tellLosses() {
  const { lost, skipped } = samples;
  const text = replay || dry ? '' : `${lost} lost, ${skipped} skipped`;
  if (text === toldLosses) return;
  toldLosses = text;
  get('losses').hidden = text === '';
  get('losses').textContent = text;
  get('losses').title = `Of the periods since this page was opened, ${lost} did not reach it; ${skipped} were left out by the engine because it woke up late.`;
}

async function order(wish) {
  const answer = await act.ask(wish);
  if (!answer.ok) act.tell(answer.message);
}

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
for (const box of document.querySelectorAll('[data-layer]')) {
  box.addEventListener('change', () => {
    if (box.dataset.layer === 'objects') world.show(box.checked);
    else stage.show(box.dataset.layer, box.checked);
  });
}
get('view').addEventListener('keydown', (event) => {
  const name = ['iso', 'front', 'side', 'top'][Number(event.key) - 1];
  const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  const zoom = { '+': 0.85, '-': 1 / 0.85 }[event.key];
  if (name) stage.look(name);
  if (turn) stage.turn(turn[0] * 0.1, turn[1] * 0.1);
  if (zoom) stage.zoom(zoom);
  if (turn || zoom) event.preventDefault();
});
get('view').addEventListener('pointermove', (event) => {
  if (measure.on) return;
  const found = stage.under(event.offsetX, event.offsetY);
  const planned = found && program.plan && program.plan.commands.find((entry) => entry.index === found.command);
  stage.showPose(found ? found.joints : null);
  if (!found) { hint(world.under(event.offsetX, event.offsetY)); return; }
  const place = found.point.map((value) => (value * 1000).toFixed(1)).join(', ');
  hint(`${place} mm at ${found.time.toFixed(2)} s, ${(found.speed * 1000).toFixed(0)} mm/s${planned ? `, line ${planned.line} ${planned.name}` : ''}`);
});
let pressed = null;
get('view').addEventListener('pointerdown', (event) => { pressed = [event.offsetX, event.offsetY]; });
get('view').addEventListener('pointerup', (event) => {
  // A drag turns the picture.
  const still = pressed && Math.hypot(event.offsetX - pressed[0], event.offsetY - pressed[1]) < 4;
  if (measure.on && still) measure.click(event.offsetX, event.offsetY);
});
get('measure').addEventListener('click', () => get('measure').setAttribute('aria-pressed', String(measure.toggle())));
const grip = (call) => async () => {
  const ready = status && status.state === 'ready';
  await order({ do: 'run', name: 'pendant', program: `${ready ? '' : 'InitCanon()\n'}${call}()\n` });
};
get('grip-open').addEventListener('click', grip('OpenGripper'));
get('grip-close').addEventListener('click', grip('CloseGripper'));

drawRamp(get('legend'));
requestAnimationFrame(frame);

// What tests look at.
window.__view = { act, samples, stage, world, plots, pendant, program, poses, queue, lists, player, measure, gamepads, get status() { return status; }, get robot() { return robot; }, get dry() { return dry; }, get opened() { return opened; } };
