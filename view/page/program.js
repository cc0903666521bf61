// The program: its text, findings, the line under way, certificate of the move.

import { JOINTS } from './colours.js';

const get = (id) => document.getElementById(id);
/** How many limits of a move are named one by one. */
const MOST_LIMITS = 4;

export class Program {
  /** `act` has ask(wish), tell(text), joints(), status(). */
  constructor(act) {
    this.act = act;
    this.running = null;
    /** The command under way, and its time (s). */
    this.command = null;
    this.at_s = 0;
    this.plan = null;
    this.edited = false;
    /** Whether the text is another one than that of the plan. */
    this.stale = false;
    this.line = 0;
    this.bad = new Set();
    this.name = 'page.canon';
    this.text = get('text');
    this.text.addEventListener('input', () => { this.edited = true; this.stale = true; this.bad.clear(); this.draw(); });
    this.text.addEventListener('scroll', () => this.scrolled());
    // The move of the cursor's line tells why it takes as long as it does.
    for (const event of ['click', 'keyup', 'focus', 'blur']) this.text.addEventListener(event, () => this.certify(this.command, this.at_s));
    get('plan').addEventListener('click', () => this.preview());
    get('run').addEventListener('click', () => this.run(false));
    get('step-on').addEventListener('click', () => this.step());
    get('open').addEventListener('click', () => get('file').click());
    get('file').addEventListener('change', (event) => this.load(event.target.files[0]));
    this.draw();
  }

  async load(file) {
    if (!file) return;
    this.set(file.name, await file.text());
    this.edited = true;
    this.preview();
  }

  set(name, text) {
    this.name = name || 'program';
    this.text.value = text;
    this.edited = false;
    this.bad.clear();
    get('program-name').textContent = this.name.split('/').pop();
    this.draw();
  }

  /** The engine was given a program: it is shown unless this page has another one in work. */
  given(program) {
    // What the pendant sends is no program of a person.
    if (program.name === 'pendant') return;
    this.running = program;
    if (!this.edited || program.text === this.text.value) this.set(program.name, program.text);
  }

  async preview() {
    get('plan').disabled = true;
    const form = /^\s*[{[]/.test(this.text.value) ? 'json' : 'text';
    const start = this.act.joints();
    const answer = await this.act.ask({ do: 'plan', name: this.name, form, program: this.text.value, start });
    get('plan').disabled = false;
    if (!answer.ok) this.act.tell(answer.message);
  }

  /** Runs the program, or lets one go on that waits from command to command. */
  async run(stepwise) {
    const { status } = this.act;
    const waits = status() && !status().idle && status().single_step;
    if (!await this.order({ do: 'single_step', on: stepwise }) || waits) return;
    if (!await this.order({ do: 'run', name: this.name, program: this.text.value })) return;
    this.edited = false;
    if (stepwise) await this.order({ do: 'next' });
  }

  /** Executes one command: the next one, or the first of the program. */
  step() {
    const status = this.act.status();
    return status && !status.idle && status.single_step ? this.order({ do: 'next' }) : this.run(true);
  }

  async order(wish) {
    const answer = await this.act.ask(wish);
    if (!answer.ok) this.act.tell(answer.message);
    return answer.ok;
  }

  /** Inserts a line behind that of the cursor, and before the end of the program. */
  insert(line) {
    const { value, selectionStart: at } = this.text;
    const end = value.indexOf('\n', at);
    const behind = value === '' ? 0 : (end < 0 ? value.length : end + 1);
    const last = value.search(/^[ \t]*EndCanon\b/m);
    const place = last >= 0 && last < behind ? last : behind;
    const before = value.slice(0, place);
    const text = `${before === '' || before.endsWith('\n') ? '' : '\n'}${line}\n`;
    this.text.value = before + text + value.slice(place);
    this.text.selectionStart = this.text.selectionEnd = place + text.length - 1;
    this.edited = true;
    this.draw();
  }

  /** Puts a pose in place of the first one in the line of the cursor; says whether there is one. */
  replacePose(pose) {
    const { value, selectionStart: at } = this.text;
    const from = value.lastIndexOf('\n', at - 1) + 1;
    const end = value.indexOf('\n', at) < 0 ? value.length : value.indexOf('\n', at);
    const line = value.slice(from, end);
    const list = '\\{[^{}]*\\}';
    const changed = line.replace(new RegExp(`\\{\\s*${list}\\s*,\\s*${list}\\s*,\\s*${list}\\s*\\}`), pose);
    if (changed === line) return false;
    this.text.value = value.slice(0, from) + changed + value.slice(end);
    this.text.selectionStart = this.text.selectionEnd = from;
    this.edited = true;
    this.draw();
    return true;
  }

  /** A plan has come: findings, certificates. */
  planned(plan) {
    this.plan = plan.ok ? plan : null;
    this.stale = false;
    const found = [
      ...(plan.findings || []),
      ...(plan.refusals || []).map((refusal) => ({ severity: 'error', ...refusal, message: `${refusal.name}: ${refusal.message}` })),
      ...(plan.error ? [{ severity: 'error', line: 1, column: 1, message: plan.error }] : []),
    ];
    this.shown = null;
    get('certificate').replaceChildren();
    this.bad = new Set(found.filter((finding) => finding.severity !== 'warning').map((finding) => finding.line));
    get('findings').replaceChildren(...found.map((finding) => this.finding(finding)));
    this.draw();
    this.certify(null, 0);
  }

  finding({ severity, line, column, message, help }) {
    const item = document.createElement('li');
    const button = document.createElement('button');
    button.dataset.severity = String(severity).toLowerCase();
    button.textContent = `${line}:${column}  ${message}${help ? `. ${help}` : ''}`;
    button.addEventListener('click', () => this.go(line));
    item.append(button);
    return item;
  }

  go(line) {
    const lines = this.text.value.split('\n');
    const from = lines.slice(0, line - 1).reduce((sum, text) => sum + text.length + 1, 0);
    this.text.focus();
    this.text.setSelectionRange(from, from + (lines[line - 1] || '').length);
    this.text.scrollTop = Math.max(0, (line - 5) * 19);
  }

  /** Command number `id` of the session is at `time` s of its path. */
  at(id, time) {
    const running = this.running;
    const index = running && id >= running.first && id <= running.last ? id - running.first : -1;
    return this.show(this.plan && this.plan.commands.find((found) => found.index === index), time);
  }

  /** Shows that a command of the plan is at `time` s of its path; none without. */
  show(command, time) {
    this.at_s = time;
    this.command = command || null;
    const line = command && !this.edited ? command.line : 0;
    if (line !== this.line) { this.line = line; this.draw(); }
    this.follow(line);
    this.certify(command || null, time);
    return command || null;
  }

  follow(line) {
    // The browser moves the text by itself where the place for it becomes larger or smaller.
    if (this.text.scrollTop !== this.drawnTop) this.scrolled();
    const top = (line - 1) * 19;
    const { scrollTop, clientHeight } = this.text;
    if (line > 0 && document.activeElement !== this.text && (top < scrollTop || top > scrollTop + clientHeight - 40)) {
      this.text.scrollTop = Math.max(0, top - clientHeight / 3);
    }
  }

  draw() {
    const count = this.text.value.split('\n').length;
    get('gutter').textContent = Array.from({ length: count }, (_, k) => k + 1).join('\n');
    get('marks').replaceChildren(...Array.from({ length: count }, (_, k) => {
      const mark = document.createElement('span');
      if (k + 1 === this.line) mark.className = 'now';
      else if (this.bad.has(k + 1)) mark.className = 'bad';
      return mark;
    }));
    this.scrolled();
  }

  scrolled() {
    // Their own scrolling would end where the text has a scroll bar.
    this.drawnTop = this.text.scrollTop;
    for (const id of ['gutter', 'marks']) get(id).style.transform = `translateY(${-this.text.scrollTop}px)`;
  }

  /** Why the move takes as long as it does: the one under way, else the one of the cursor's line. */
  certify(command, time) {
    const place = get('certificate');
    const still = this.act.status()?.idle !== false;
    const shown = (still ? this.atCursor() || command : command || this.atCursor());
    const under = shown === command;
    const certificate = shown && shown.certificate;
    if (!certificate) {
      if (this.shown !== null) { place.replaceChildren(); this.shown = null; }
      if (this.plan && !shown && place.childElementCount === 0) this.sum(place);
      return;
    }
    if (this.shown !== shown) { this.shown = shown; place.replaceChildren(...why(shown)); }
    place.querySelector('.needle').hidden = !under;
    place.querySelector('.needle').style.left = `${Math.min(time / Math.max(certificate.duration_s, 1e-9), 1) * 100}%`;
    const active = (names) => certificate.active.some((stretch) => names.split('|').includes(stretch.limit) && time >= stretch.start_s && time <= stretch.end_s);
    const rows = [...place.querySelectorAll('[data-limit]')];
    const now = rows.filter((found) => under && active(found.dataset.limit));
    for (const found of rows) {
      const none = found.dataset.limit === '' && under && now.length === 0;
      found.classList.toggle('now', now.includes(found) || none);
    }
  }

  /** The move in whose lines the cursor stands, where nothing is under way. */
  atCursor() {
    if (!this.plan || this.stale || document.activeElement !== this.text) return null;
    const line = this.text.value.slice(0, this.text.selectionStart).split('\n').length;
    const begun = this.plan.commands.filter((command) => command.line <= line);
    return begun.length > 0 ? begun[begun.length - 1] : null;
  }

  sum(place) {
    const moves = this.plan.commands.filter((command) => command.certificate);
    const largest = Math.max(0, ...moves.flatMap((command) => command.certificate.limits.map((limit) => limit.ratio)));
    place.replaceChildren(row('planned', `${this.plan.duration_s.toFixed(3)} s, ${moves.length} moves`),
      row('nearest to a limit', `${(largest * 100).toFixed(1)} %`));
  }
}

/** How much of a time is in at least one of the stretches. */
function covered(stretches) {
  let [sum, end] = [0, 0];
  for (const { start_s: from, end_s: to } of [...stretches].sort((a, b) => a.start_s - b.start_s)) {
    sum += Math.max(0, to - Math.max(from, end));
    end = Math.max(end, to);
  }
  return sum;
}

/** A bar of the limits over the time of a move, and what they are. */
function why({ name, line, certificate }) {
  const { active, duration_s: whole, poses } = certificate;
  const of = (limit) => active.filter((stretch) => stretch.limit === limit);
  const share = (stretches) => covered(stretches) / Math.max(whole, 1e-9);
  const limits = [...new Set(active.map((stretch) => stretch.limit))].sort((a, b) => share(of(b)) - share(of(a)));
  const bar = document.createElement('div');
  bar.className = 'why';
  for (const stretch of active) {
    const part = document.createElement('div');
    part.style.left = `${stretch.start_s / whole * 100}%`;
    part.style.width = `${(stretch.end_s - stretch.start_s) / whole * 100}%`;
    part.style.background = colourOf(limits.indexOf(stretch.limit));
    part.title = `${stretch.limit}: ${stretch.start_s.toFixed(3)} to ${stretch.end_s.toFixed(3)} s`;
    bar.append(part);
  }
  const needle = document.createElement('div');
  needle.className = 'needle';
  bar.append(needle);
  const rows = limits.map((limit, index) => [limit, limit, share(of(limit)), colourOf(index)]);
  rows.push(['', 'none: a tolerance, or a change of limits', 1 - share(active), 'transparent']);
  const seen = rows.filter(([, , part]) => part > 0.005).sort((a, b) => b[2] - a[2]);
  const rest = seen.splice(MOST_LIMITS).map(([limit]) => limit);
  if (rest.length > 0) {
    const part = share(active.filter((stretch) => rest.includes(stretch.limit)));
    seen.push([rest.join('|'), `${rest.length} more: ${rest.join(', ')}`, part, 'transparent']);
  }
  const list = document.createElement('div');
  list.className = 'limits';
  list.append(...seen.map((row) => limitRow(...row)));
  const parts = [row(`${line ? `line ${line}: ` : ''}${name}`, `${whole.toFixed(3)} s`), bar, list,
    row('no motion is shorter than', `${certificate.lower_bound_s.toFixed(3)} s`)];
  if (poses.length > 0) {
    const worst = Math.max(...poses.map((pass) => pass.deviation_m / Math.max(pass.tolerance_m, 1e-12)));
    parts.push(row('poses', `${poses.length}, passed within ${(worst * 100).toFixed(0)} % of the tolerance`));
  }
  return parts;
}

const colourOf = (index) => JOINTS[index % JOINTS.length];

/** One limit: its colour in the bar, its name, its share of the time. */
function limitRow(limit, text, share, colour) {
  const made = row(text, `${(share * 100).toFixed(0)} %`);
  made.dataset.limit = limit;
  made.title = text;
  made.style.setProperty('--mark', colour);
  return made;
}

function row(name, value) {
  const line = document.createElement('div');
  line.className = 'bar';
  line.style.minHeight = '0';
  const [left, right] = [document.createElement('span'), document.createElement('span')];
  left.className = 'dim grow';
  left.textContent = name;
  right.className = 'num';
  right.textContent = value;
  line.append(left, right);
  return line;
}
