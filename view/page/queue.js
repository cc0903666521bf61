// The commands that are under way and still to come, with their times.

const get = (id) => document.getElementById(id);
const MOST = 40;

export class Queue {
  constructor(program) {
    this.program = program;
    this.drawn = '';
  }

  /** `command` of the plan is at `time` s of its path; `status` is the engine's. */
  set(command, time, status) {
    const { plan } = this.program;
    const active = command && plan && status && !status.idle;
    const from = active ? plan.commands.indexOf(command) : -1;
    const rest = active ? plan.commands.slice(from, from + MOST) : [];
    const left = active ? plan.duration_s - command.start_s - time : 0;
    const waits = status && status.single_step && !status.idle && !status.command;
    get('queue-sum').textContent = words(status, left, waits);
    const key = `${this.program.running?.number} ${from} ${rest.length}`;
    if (key === this.drawn) { this.bar(command, time); return; }
    this.drawn = key;
    get('queue').replaceChildren(...rest.map((entry, index) => row(entry, index === 0)));
    this.bar(command, time);
  }

  bar(command, time) {
    const first = get('queue').firstElementChild;
    if (first && command) first.style.setProperty('--done', `${Math.min(time / Math.max(command.duration_s, 1e-6), 1) * 100}%`);
  }
}

function words(status, left, waits) {
  if (!status || status.queued === undefined) return '';
  if (status.idle) return 'nothing waits';
  if (waits) return `the next command waits for Step; ${status.queued + 1} to come`;
  const count = status.queued === 1 ? '1 command waits' : `${status.queued} commands wait`;
  return left > 0 ? `${count}, ${left.toFixed(1)} s to the end` : count;
}

function row({ line, name, duration_s: seconds }, now) {
  const item = document.createElement('li');
  if (now) item.className = 'now';
  const cells = [String(line), name, seconds > 0 ? `${seconds.toFixed(2)} s` : ''];
  item.append(...cells.map((text) => { const cell = document.createElement('span'); cell.textContent = text; return cell; }));
  return item;
}
