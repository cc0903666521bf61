// The time controls of a recording.

const get = (id) => document.getElementById(id);

export class Player {
  constructor(ask) {
    this.ask = ask;
    this.state = null;
    this.seeking = false;
    get('play').addEventListener('click', () => this.play(!this.state?.plays));
    get('play-speed').addEventListener('change', () => this.play(this.state?.plays ?? true));
    get('seek').addEventListener('pointerdown', () => { this.seeking = true; });
    get('seek').addEventListener('input', (event) => ask({ do: 'seek', at: Number(event.target.value) }));
    get('seek').addEventListener('change', () => { this.seeking = false; });
  }

  play(plays) { this.ask({ do: 'play', plays, speed: Number(get('play-speed').value) }); }

  set(state) {
    this.state = state;
    get('player').hidden = false;
    get('play').textContent = state.plays ? 'Pause' : 'Play';
    const seek = get('seek');
    seek.max = state.duration_s;
    if (!this.seeking) seek.value = state.at_s;
    get('seek-time').textContent = `${state.at_s.toFixed(2)} / ${state.duration_s.toFixed(2)} s`;
  }
}
