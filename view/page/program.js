// The program: its text, findings, the line under way, certificate of the move.

import { JOINTS } from './colours.js';

const get = (id) => document.getElementById(id);

export class Program {
  /** `act` has ask(wish), tell(text), joints(), status(). */
  constructor(act) {
    this.act = act;
    this.running = null;
    this.plan = null;
    this.edited = false;
    this.line = 0;
    this.bad = new Set();
    this.name = 'page.canon';
    this.text = get('text');
    this.text.addEventListener('input', () => { this.edited = true; this.bad.clear(); this.draw(); });
    this.text.addEventListener('scroll', () => this.scrolled());
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
    const line = command && !this.edited ? command.line : 0;
    if (line !== this.line) { this.line = line; this.draw(); }
    this.follow(line);
    this.certify(command || null, time);
    return command || null;
  }

  follow(line) {
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
    for (const id of ['gutter', 'marks']) get(id).style.transform = `translateY(${-this.text.scrollTop}px)`;
  }

  /** Why the move takes as long as it does. */
  certify(command, time) {
    const place = get('certificate');
    const certificate = command && command.certificate;
    if (!certificate) {
      if (this.shown !== null) { place.replaceChildren(); this.shown = null; }
      if (this.plan && !command && this.shown === null) this.sum(place);
      return;
    }
    if (this.shown !== command) { this.shown = command; place.replaceChildren(...this.why(command)); }
    const active = certificate.active.find((stretch) => time >= stretch.start_s && time <= stretch.end_s);
    const now = place.querySelector('[data-now]');
    if (now) now.textContent = active ? active.limit : '-';
  }

  sum(place) {
    const moves = this.plan.commands.filter((command) => command.certificate);
    const largest = Math.max(0, ...moves.flatMap((command) => command.certificate.limits.map((limit) => limit.ratio)));
    place.replaceChildren(row('planned', `${this.plan.duration_s.toFixed(3)} s, ${moves.length} moves`),
      row('nearest to a limit', `${(largest * 100).toFixed(1)} %`));
  }

  why({ name, line, certificate }) {
    const bar = document.createElement('div');
    bar.className = 'why';
    const limits = [...new Set(certificate.active.map((stretch) => stretch.limit))];
    for (const stretch of certificate.active) {
      const part = document.createElement('div');
      part.style.left = `${stretch.start_s / certificate.duration_s * 100}%`;
      part.style.width = `${(stretch.end_s - stretch.start_s) / certificate.duration_s * 100}%`;
      part.style.background = JOINTS[limits.indexOf(stretch.limit) % JOINTS.length];
      part.title = `${stretch.limit}: ${stretch.start_s.toFixed(3)} to ${stretch.end_s.toFixed(3)} s`;
      bar.append(part);
    }
    const now = row('limited by', '-');
    now.lastChild.dataset.now = 'true';
    const parts = [row(`line ${line}: ${name}`, `${certificate.duration_s.toFixed(3)} s`), bar, now,
      row('no motion is shorter than', `${certificate.lower_bound_s.toFixed(3)} s`)];
    if (certificate.poses.length > 0) {
      const worst = Math.max(...certificate.poses.map((pass) => pass.deviation_m / Math.max(pass.tolerance_m, 1e-12)));
      parts.push(row('poses', `${certificate.poses.length}, passed within ${(worst * 100).toFixed(0)} % of the tolerance`));
    }
    return parts;
  }
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
