// Every servo period of the last ten minutes, in memory of a fixed largest size.

/** Length of the head of a block (bytes). */
const HEAD = 32;
const CHUNK = 8192;
const MOST_ROWS = 600000;
export const COMMAND = 0;
export const PATH_TIME = 1;
export const RATE = 2;
export const LATE = 3;
export const POINT = 4;
export const Q = 7;

export class Samples {
  constructor() { this.clear(0, 0.001); }

  clear(joints, period) {
    this.joints = joints;
    this.period = period;
    this.stride = Q + 4 * joints + 1;
    this.chunks = [];
    this.dropped = 0;
    this.count = 0;
    this.lastTick = -1;
    this.lastSequence = -1;
    /** Periods that were published and did not get here. */
    this.lost = 0;
    /** Periods that the engine left out. */
    this.skipped = 0;
  }

  /** Takes a block of the server; says whether time went back: another place of a recording. */
  take(buffer) {
    const head = new DataView(buffer, 0, HEAD);
    const joints = head.getUint16(4, true);
    const width = head.getUint16(6, true);
    const rows = head.getUint32(8, true);
    const period = head.getUint32(12, true) * 1e-9;
    const first = Number(head.getBigUint64(16, true));
    const sequence = Number(head.getBigUint64(24, true));
    const back = first <= this.lastTick;
    if (joints !== this.joints || back) this.clear(joints, period);
    this.period = period;
    this.compare(first, sequence);
    const numbers = new Float32Array(buffer, HEAD);
    for (let row = 0; row < rows; row += 1) {
      this.push(numbers, row * width, width, first + row);
    }
    this.lastTick = first + rows - 1;
    this.lastSequence = sequence + rows - 1;
    return back;
  }

  /** Counts what is missing between the last row and the next one. */
  compare(tick, sequence) {
    if (this.lastTick < 0) return;
    const passed = tick - this.lastTick - 1;
    // After a recovery the engine counts anew: then it left the periods between out.
    const lost = sequence > this.lastSequence ? Math.min(sequence - this.lastSequence - 1, passed) : 0;
    this.lost += lost;
    this.skipped += passed - lost;
  }

  push(numbers, from, width, tick) {
    const inChunk = this.count % CHUNK;
    if (inChunk === 0) this.chunks.push({ ticks: new Float64Array(CHUNK), data: new Float32Array(CHUNK * this.stride) });
    const chunk = this.chunks[this.chunks.length - 1];
    const at = inChunk * this.stride;
    for (let k = 0; k < width; k += 1) chunk.data[at + k] = numbers[from + k];
    chunk.ticks[inChunk] = tick;
    this.count += 1;
    if ((this.chunks.length - 1) * CHUNK > MOST_ROWS) {
      this.chunks.shift();
      this.count -= CHUNK;
      this.dropped += CHUNK;
    }
  }

  /** Takes the rows of a plan in place of all others. */
  fill({ path, commands }, joints) {
    this.clear(joints, path.step_s);
    const row = new Float32Array(this.stride);
    for (const [k, point] of path.points.entries()) {
      const command = commands.find((found) => found.index === path.commands[k]);
      row.set([path.commands[k], k * path.step_s - (command?.start_s ?? 0), 1, 0, ...point]);
      const lists = [path.joints, path.velocities, path.accelerations, path.joints];
      if (joints > 0) for (const [index, list] of lists.entries()) row.set(list[k], Q + index * joints);
      this.push(row, 0, this.stride - 1, k);
    }
    this.lastTick = path.points.length - 1;
  }

  /** A number of a row, from the oldest that is kept. */
  at(row, column) {
    const chunk = this.chunks[Math.floor(row / CHUNK)];
    return chunk.data[(row % CHUNK) * this.stride + column];
  }

  tick(row) { return this.chunks[Math.floor(row / CHUNK)].ticks[row % CHUNK]; }

  /** The row at a tick, or the one before it. */
  rowAt(tick) {
    let low = 0;
    let high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.tick(middle) <= tick) low = middle; else high = middle - 1;
    }
    return low;
  }

  /** Joint positions of a row: measured or published. */
  jointsAt(row, measured) {
    const from = Q + (measured ? 3 * this.joints : 0);
    return Array.from({ length: this.joints }, (_, joint) => this.at(row, from + joint));
  }

  /** Joint positions of the newest row. */
  newestJoints(measured) { return this.count === 0 ? null : this.jointsAt(this.count - 1, measured); }
}
