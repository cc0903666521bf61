// Plots over time: every period is drawn, as the least and the largest value of each pixel column.

import { JOINTS, styled } from './colours.js';
import { LATE, POINT, Q, RATE } from './samples.js';

const MOST_S = 600;
const LEAST_S = 0.05;

/** Speed of the controlled point at a row (m/s). */
function speedAt(samples, row) {
  if (row === 0) return 0;
  let sum = 0;
  for (let axis = 0; axis < 3; axis += 1) sum += (samples.at(row, POINT + axis) - samples.at(row - 1, POINT + axis)) ** 2;
  return Math.sqrt(sum) / samples.period;
}

/** What can be plotted of a tool without an arm, at most `speed` m/s fast. */
function ofTool(speed, samples) {
  const slope = (row) => (row === 0 ? 0 : (speedAt(samples, row) - speedAt(samples, row - 1)) / samples.period);
  return [
    { title: 'Tool speed', unit: 'mm/s', scale: 1000, lines: ['tool'], limit: speed * 1000, value: (row) => speedAt(samples, row) },
    { title: 'Change of speed', unit: 'm/s\u00b2', scale: 1, lines: ['along the path'], value: slope },
  ];
}

/** What can be plotted: title, unit, one value of a row for each line. What is `live` only means
 * nothing of a plan. */
function quantities(robot, samples) {
  const n = robot.joints.length;
  const joint = (list) => (row, k) => samples.at(row, Q + list * n + k);
  const share = (value, limits) => (row, k) => value(row, k) / limits[k];
  const span = robot.lower.map((low, k) => (low === null || robot.upper[k] === null ? Math.PI : Math.max(Math.abs(low), Math.abs(robot.upper[k]))));
  const jerk = (row, k) => (row === 0 ? 0 : (samples.at(row, Q + 2 * n + k) - samples.at(row - 1, Q + 2 * n + k)) / samples.period);
  /** How late a setpoint was published, and how much longer than a period the time since the last. */
  const timing = (row, k) => {
    const late = samples.at(row, LATE);
    if (k === 0) return late;
    const follows = row > 0 && samples.tick(row) === samples.tick(row - 1) + 1;
    return follows ? late - samples.at(row - 1, LATE) : 0;
  };
  const names = robot.joints.map((_, k) => `J${k + 1}`);
  return [
    { title: 'Position', unit: '% of range', scale: 100, lines: names, limit: 100, value: share(joint(0), span) },
    { title: 'Velocity', unit: '% of limit', scale: 100, lines: names, limit: 100, value: share(joint(1), robot.velocity) },
    { title: 'Acceleration', unit: '% of limit', scale: 100, lines: names, limit: 100, value: share(joint(2), robot.acceleration) },
    { title: 'Jerk', unit: '% of limit', scale: 100, lines: names, limit: 100, value: share(jerk, robot.jerk) },
    { title: 'Tool speed', unit: 'mm/s', scale: 1000, lines: ['tool'], limit: robot.tool.speed * 1000, value: (row) => speedAt(samples, row) },
    { title: 'Following', live: true, unit: 'mrad or mm', scale: 1000, lines: names, value: (row, k) => samples.at(row, Q + k) - samples.at(row, Q + 3 * n + k) },
    { title: 'Path speed', live: true, unit: '%', scale: 100, lines: ['override'], limit: 100, value: (row) => samples.at(row, RATE) },
    { title: 'Period', live: true, unit: '\u00b5s', scale: 1, lines: ['published late', 'longer than a period'], value: timing },
  ];
}

/** The next larger of 1, 2, 5, 10, 20, ... */
function round(value) {
  const step = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((k) => k * step).find((found) => found >= value * 0.999999);
}

export class Plots {
  constructor(canvas, samples) {
    this.canvas = canvas;
    this.samples = samples;
    this.window = 10;
    /** The tick at the right edge; none while it follows. */
    this.end = null;
    this.chosen = 1;
    this.all = [];
    this.dirty = true;
    this.cursor = null;
    /** A time (s) that is marked where the rows are those of a plan; none while the arm is live. */
    this.mark = null;
    canvas.addEventListener('wheel', (event) => this.zoom(event), { passive: false });
    canvas.addEventListener('pointerdown', (event) => { canvas.setPointerCapture(event.pointerId); this.drag = { x: event.clientX, end: this.right() }; });
    canvas.addEventListener('pointermove', (event) => this.move(event));
    canvas.addEventListener('pointerup', () => { this.drag = null; });
    canvas.addEventListener('pointercancel', () => { this.drag = null; });
    canvas.addEventListener('pointerleave', () => { this.cursor = null; this.dirty = true; });
    canvas.addEventListener('keydown', (event) => this.key(event));
    new ResizeObserver(() => { this.dirty = true; }).observe(canvas);
  }

  setRobot(robot) { this.all = quantities(robot, this.samples); this.dirty = true; }

  /** A tool without an arm (m/s). */
  setTool(speed) { this.all = ofTool(speed, this.samples); this.chosen = 0; this.dirty = true; }

  /** The rows are those of a plan: all of it is shown, by its own time. */
  setPlan(duration) {
    this.mark = 0;
    this.all = this.all.filter((quantity) => !quantity.live);
    this.chosen = Math.min(this.chosen, this.all.length - 1);
    this.end = null;
    this.setWindow(Math.max(duration, (this.samples.count - 1) * this.samples.period));
  }

  choose(index) { this.chosen = index; this.dirty = true; }

  get frozen() { return this.end !== null; }

  freeze(frozen) {
    this.end = frozen ? this.right() : null;
    this.dirty = true;
    this.onfreeze?.(frozen);
  }

  right() {
    if (this.end !== null) return this.end;
    return this.samples.count > 0 ? this.samples.tick(this.samples.count - 1) : 0;
  }

  zoom(event) {
    event.preventDefault();
    this.setWindow(this.window * Math.exp(event.deltaY * 0.0015));
  }

  setWindow(seconds) { this.window = Math.min(Math.max(seconds, LEAST_S), MOST_S); this.dirty = true; }

  move(event) {
    const box = this.canvas.getBoundingClientRect();
    this.cursor = event.clientX - box.left;
    this.dirty = true;
    if (!this.drag) return;
    const moved = (event.clientX - this.drag.x) / box.width * this.window / this.samples.period;
    if (Math.abs(event.clientX - this.drag.x) < 3 && !this.frozen) return;
    if (!this.frozen) this.onfreeze?.(true);
    this.end = Math.round(this.drag.end - moved);
  }

  key(event) {
    const step = this.window / this.samples.period / 10;
    const moves = { ArrowLeft: -step, ArrowRight: step };
    if (event.key in moves) {
      const end = this.right() + moves[event.key];
      if (!this.frozen) this.onfreeze?.(true);
      this.end = Math.round(end);
    } else if (event.key === '+' || event.key === '-') {
      this.setWindow(this.window * (event.key === '+' ? 0.7 : 1.4));
    } else {
      return;
    }
    this.dirty = true;
    event.preventDefault();
  }

  /** The row that is looked back at: the one under the pointer, or the last one shown. */
  lookedAt() {
    if (this.mark !== null || !this.frozen || this.samples.count === 0) return null;
    const [, last, left, right] = this.rows();
    if (this.cursor === null || this.cursor < 58) return last;
    return this.samples.rowAt(left + (this.cursor - 58) / (this.canvas.clientWidth - 70) * (right - left));
  }

  /** First and last row that are shown. */
  rows() {
    const right = this.right();
    const left = right - this.window / this.samples.period;
    return [this.samples.rowAt(left), this.samples.rowAt(right), left, right];
  }

  /** What is shown, as a table. */
  csv() {
    const quantity = this.all[this.chosen];
    if (!quantity || this.samples.count === 0) return '';
    const [first, last] = this.rows();
    const lines = [`t_s,${quantity.lines.map((name) => `${name} (${quantity.unit})`).join(',')}`];
    for (let row = first; row <= last; row += 1) {
      const values = quantity.lines.map((_, k) => quantity.value(row, k) * quantity.scale);
      lines.push([this.samples.tick(row) * this.samples.period, ...values].join(','));
    }
    return `${lines.join('\n')}\n`;
  }

  draw() {
    if (!this.dirty && (this.frozen || this.mark !== null)) return;
    this.dirty = false;
    const ratio = Math.min(devicePixelRatio, 2);
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    if (this.canvas.width !== Math.round(clientWidth * ratio) || this.canvas.height !== Math.round(clientHeight * ratio)) {
      this.canvas.width = Math.round(clientWidth * ratio);
      this.canvas.height = Math.round(clientHeight * ratio);
    }
    const context = this.canvas.getContext('2d');
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, clientWidth, clientHeight);
    const quantity = this.all[this.chosen];
    if (!quantity) return;
    const area = { x: 58, y: 14, width: clientWidth - 70, height: clientHeight - 36 };
    if (this.samples.count === 0) { this.frame(context, area, quantity, [-1, 1]); return; }
    const columns = this.columns(quantity, Math.floor(area.width));
    const range = this.range(columns, quantity);
    this.frame(context, area, quantity, range);
    context.save();
    context.beginPath();
    context.rect(area.x, area.y, area.width, area.height);
    context.clip();
    for (const [k, column] of columns.entries()) this.line(context, area, column, range, JOINTS[k % JOINTS.length]);
    context.restore();
    this.drawMark(context, area);
    this.tellCursor(context, area, quantity);
  }

  /** Least and largest value of each pixel column, for each line. */
  columns(quantity, width) {
    const [first, last, left, right] = this.rows();
    const perTick = width / Math.max(right - left, 1);
    const stride = Math.max(1, Math.floor((last - first) / (width * 64)));
    return quantity.lines.map((_, k) => {
      const low = new Float64Array(width).fill(Infinity);
      const high = new Float64Array(width).fill(-Infinity);
      for (let row = first; row <= last; row += stride) {
        const x = Math.floor((this.samples.tick(row) - left) * perTick);
        if (x < 0 || x >= width) continue;
        const value = quantity.value(row, k) * quantity.scale;
        if (value < low[x]) low[x] = value;
        if (value > high[x]) high[x] = value;
      }
      return { low, high };
    });
  }

  range(columns, quantity) {
    let [low, high] = [Infinity, -Infinity];
    for (const column of columns) {
      for (const value of column.low) if (value < low) low = value;
      for (const value of column.high) if (value > high) high = value;
    }
    if (low > high) [low, high] = [-1, 1];
    // A line at rest is no reason to look at its last digits.
    const least = quantity.limit ? quantity.limit * 0.05 : 0.02;
    if (high - low < least) { const middle = (low + high) / 2; low = middle - least / 2; high = middle + least / 2; }
    const room = (high - low) * 0.08;
    return [low - room, high + room];
  }

  frame(context, area, quantity, [low, high]) {
    const nice = round((high - low) / 5);
    context.font = '11px system-ui, "DejaVu Sans", sans-serif';
    context.lineWidth = 1;
    context.textBaseline = 'middle';
    context.textAlign = 'right';
    const y = (value) => area.y + area.height * (1 - (value - low) / (high - low));
    for (let value = Math.ceil(low / nice) * nice; value <= high; value += nice) {
      context.strokeStyle = styled('--edge');
      context.beginPath();
      context.moveTo(area.x, Math.round(y(value)) + 0.5);
      context.lineTo(area.x + area.width, Math.round(y(value)) + 0.5);
      context.stroke();
      context.fillStyle = styled('--dim');
      context.fillText(String(Number(value.toPrecision(6))), area.x - 6, y(value));
    }
    if (quantity.limit) {
      context.strokeStyle = styled('--bad');
      context.setLineDash([5, 4]);
      for (const limit of [quantity.limit, -quantity.limit]) {
        if (limit < low || limit > high) continue;
        context.beginPath();
        context.moveTo(area.x, y(limit));
        context.lineTo(area.x + area.width, y(limit));
        context.stroke();
      }
      context.setLineDash([]);
    }
    this.times(context, area);
    context.save();
    context.translate(11, area.y + area.height / 2);
    context.rotate(-Math.PI / 2);
    context.textAlign = 'center';
    context.fillStyle = styled('--dim');
    context.fillText(quantity.unit, 0, 0);
    context.restore();
  }

  times(context, area) {
    context.textAlign = 'center';
    context.textBaseline = 'top';
    context.fillStyle = styled('--dim');
    const live = this.mark === null;
    const newest = live && this.samples.count > 0 ? this.samples.tick(this.samples.count - 1) : 0;
    const right = (this.right() - newest) * this.samples.period;
    const step = round(this.window / 6);
    for (let time = Math.ceil((right - this.window) / step - 1e-6) * step; time <= right + step * 1e-6; time += step) {
      const text = live && Math.abs(time) < step * 1e-6 ? 'now' : `${Number(time.toFixed(4))} s`;
      const x = area.x + area.width * (1 - (right - time) / this.window);
      context.fillText(text, Math.min(x, area.x + area.width - 14), area.y + area.height + 6);
    }
  }

  line(context, area, { low, high }, [least, most], colour) {
    const y = (value) => area.y + area.height * (1 - (value - least) / (most - least));
    context.strokeStyle = colour;
    context.lineWidth = 1.6;
    context.lineJoin = 'round';
    context.beginPath();
    let drawn = false;
    for (let x = 0; x < low.length; x += 1) {
      if (low[x] > high[x]) {
        // A column without a row: between two rows where the window is short, else a gap.
        if (this.window / this.samples.period > low.length) drawn = false;
        continue;
      }
      if (drawn) context.lineTo(area.x + x, y(high[x])); else context.moveTo(area.x + x, y(high[x]));
      if (high[x] > low[x]) context.lineTo(area.x + x, y(low[x]));
      drawn = true;
    }
    context.stroke();
  }

  /** Where the time is that is played of a plan. */
  drawMark(context, area) {
    if (this.mark === null) return;
    const x = area.x + area.width * (1 - (this.right() * this.samples.period - this.mark) / this.window);
    if (x < area.x || x > area.x + area.width) return;
    context.strokeStyle = styled('--accent');
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, area.y);
    context.lineTo(x, area.y + area.height);
    context.stroke();
  }

  tellCursor(context, area, quantity) {
    if (this.cursor === null || this.cursor < area.x || this.cursor > area.x + area.width) return;
    const [, , left, right] = this.rows();
    const row = this.samples.rowAt(left + (this.cursor - area.x) / area.width * (right - left));
    context.strokeStyle = styled('--dim');
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(this.cursor + 0.5, area.y);
    context.lineTo(this.cursor + 0.5, area.y + area.height);
    context.stroke();
    this.onvalues?.(quantity.lines.map((name, k) => `${name} ${(quantity.value(row, k) * quantity.scale).toFixed(2)}`));
  }
}
