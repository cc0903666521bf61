// The header: the state in a word, and what acts on the motion under way.

const get = (id) => document.getElementById(id);

/** The state in a word, and its kind. */
function stateOf(message) {
  const now = message.status;
  if (!message.engine) return ['no engine', 'off'];
  if (message.replay) return [message.replay.plays ? 'replay' : 'replay, paused', 'off'];
  if (message.dry) return ['preview, nothing moves', 'off'];
  if (now.fault) return [now.fault, 'fault'];
  if (now.held) return [now.time_scaling > 0 ? 'stopping' : 'held', 'held'];
  if (now.command === 'jog') return ['moved by hand', 'moves'];
  if (!now.idle && now.single_step && !now.command) return ['waits for Step', 'held'];
  if (!now.idle) return [now.command || 'running', 'moves'];
  return ['idle', 'idle'];
}

export class Header {
  /** `order` asks the server and tells what it refuses; `stopped` is called before a stop. */
  constructor(order, stopped) {
    const stop = () => { stopped(); order({ do: 'stop', fast: false }); };
    get('stop').addEventListener('click', stop);
    addEventListener('keydown', (event) => { if (event.key === 'Escape') stop(); });
    for (const wish of ['pause', 'resume', 'abort', 'recover']) get(wish).addEventListener('click', () => order({ do: wish }));
    get('override').addEventListener('input', (event) => {
      get('override-value').textContent = `${event.target.value} %`;
      order({ do: 'override', share: Number(event.target.value) / 100 });
    });
  }

  setRobot({ name, description, arm }) {
    get('robot-name').textContent = name;
    get('robot-name').title = description;
    get('arm-name').textContent = arm;
  }

  state(text, kind) {
    get('state').textContent = text;
    get('state').title = text;
    get('state').dataset.kind = kind;
  }

  /** Shows the state that a message of the server tells. */
  set(message) {
    const now = message.status;
    const [text, kind] = stateOf(message);
    this.state(text, kind);
    const held = Boolean(now && now.held);
    get('recover').hidden = kind !== 'fault';
    get('resume').hidden = !held;
    get('pause').hidden = held;
    get('run').textContent = now && !now.idle && now.single_step ? 'Continue' : 'Run';
    // What stands still for ever has nothing to stop.
    document.body.dataset.live = message.replay || message.dry ? 'no' : 'yes';
  }

  /** Shows how far a program of `duration` s is; nothing without a time. */
  progress(time, duration) {
    const active = time !== null;
    get('progress-bar').style.width = active ? `${Math.min(time / duration, 1) * 100}%` : '0';
    get('time').textContent = active ? `${time.toFixed(1)} / ${duration.toFixed(1)} s` : '';
  }
}
