// A gamepad as a pendant: a shoulder button is held, and a stick says where to.

/** Sticks and the axes of the pendant that they move: index of the stick, its sign. */
const STICKS = [[1, 0, -1], [0, 1, -1], [3, 2, -1], [2, 5, -1]];
/** The shoulder buttons: one of them must be held. */
const ENABLING = [4, 5];
/** How far a stick must be moved. */
const ENOUGH = 0.6;

export class Gamepads {
  constructor(pendant) {
    this.pendant = pendant;
    addEventListener('gamepaddisconnected', () => this.lose('the gamepad is gone'));
  }

  lose(why) { if (this.pendant.held?.how === 'gamepad') this.pendant.end(why); }

  /** What the first gamepad asks for: axis and direction, or nothing. */
  asks() {
    const pad = [...navigator.getGamepads()].find((found) => found && found.connected);
    if (!pad || !ENABLING.some((button) => pad.buttons[button]?.pressed)) return null;
    const moved = STICKS.filter(([stick]) => Math.abs(pad.axes[stick] ?? 0) > ENOUGH);
    // Two directions at once are a doubt.
    if (moved.length !== 1) return null;
    const [stick, index, sign] = moved[0];
    return { index, direction: Math.sign(pad.axes[stick]) * sign };
  }

  /** Looks at the gamepad, once for each picture. */
  look() {
    const held = this.pendant.held?.how === 'gamepad' ? this.pendant.held : null;
    const asked = this.asks();
    if (!asked) { this.armed = true; if (held) this.pendant.end('released'); return; }
    if (held && held.index === asked.index && held.direction === asked.direction) return;
    // After the end of a jog the stick goes back first.
    if (held) { this.pendant.end('another axis'); this.armed = false; return; }
    if (!this.armed || this.pendant.held || !this.pendant.has || !document.hasFocus()) return;
    this.armed = false;
    this.pendant.begin({ ...asked, how: 'gamepad' });
  }
}
