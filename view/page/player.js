// The time controls: of a recording, which the server plays, and of a plan, which this page plays.

const get = (id) => document.getElementById(id);

export class Player {
  /** `ask` asks the server; `show` gets the time (s) of a plan that is played here. */
  constructor(ask, show) {
    this.ask = ask;
    this.show = show;
    this.state = null;
    this.here = false;
    this.seeking = false;
    this.drawn = performance.now();
    get('play').addEventListener('click', () => this.play(!this.state?.plays));
    get('play-speed').addEventListener('change', () => this.play(this.state?.plays ?? true));
    get('seek').addEventListener('pointerdown', () => { this.seeking = true; });
    get('seek').addEventListener('input', (event) => this.seek(Number(event.target.value)));
    get('seek').addEventListener('change', () => { this.seeking = false; });
  }

  get speed() { return Number(get('play-speed').value); }

  /** A plan of this length (s) is played here. */
  setPlan(duration) {
    this.here = true;
    this.set({ at_s: 0, duration_s: duration, plays: false });
    this.show(0);
  }

  play(plays) {
    if (!this.here) { this.ask({ do: 'play', plays, speed: this.speed }); return; }
    const at = plays && this.state.at_s >= this.state.duration_s ? 0 : this.state.at_s;
    this.set({ ...this.state, at_s: at, plays });
  }

  seek(at) {
    if (!this.here) { this.ask({ do: 'seek', at }); return; }
    this.set({ ...this.state, at_s: at });
    this.show(at);
  }

  set(state) {
    this.state = state;
    get('player').hidden = false;
    get('play').textContent = state.plays ? 'Pause' : 'Play';
    const seek = get('seek');
    seek.max = state.duration_s;
    if (!this.seeking) seek.value = state.at_s;
    get('seek-time').textContent = `${state.at_s.toFixed(2)} / ${state.duration_s.toFixed(2)} s`;
  }

  /** Goes on, once for each picture. */
  turn() {
    const now = performance.now();
    const passed = (now - this.drawn) / 1000;
    this.drawn = now;
    if (!this.here || !this.state.plays) return;
    const at = Math.min(this.state.at_s + passed * this.speed, this.state.duration_s);
    this.set({ ...this.state, at_s: at, plays: at < this.state.duration_s });
    this.show(at);
  }
}
