// The WebSocket to the server: requests with answers, texts and blocks of samples.

const KEY = 'canter token';

/** The token of the address, which is then taken out of it, or of this tab's memory. */
export function token() {
  const word = location.hash.slice(1);
  if (/^[0-9a-f]{32}$/.test(word)) {
    sessionStorage.setItem(KEY, word);
    history.replaceState(null, '', location.pathname);
  }
  return sessionStorage.getItem(KEY);
}

export class Link {
  /** `on` has text(object), block(buffer), open(), closed(reason). */
  constructor(on) {
    this.on = on;
    this.number = 0;
    this.waiting = new Map();
    this.socket = null;
    this.token = token();
    this.tries = 0;
    this.connect();
  }

  connect() {
    if (!this.token) {
      this.on.closed('This address lacks its token. Open the address that canter has printed.', true);
      return;
    }
    const socket = new WebSocket(`ws://${location.host}/live`, ['canter', `token.${this.token}`]);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => { this.tries = 0; this.on.open(); };
    socket.onmessage = (event) => this.take(event.data);
    socket.onclose = () => this.closed();
    this.socket = socket;
  }

  take(data) {
    if (typeof data !== 'string') {
      this.on.block(data);
      return;
    }
    const message = JSON.parse(data);
    if (message.is === 'answer') {
      const waiting = this.waiting.get(message.number);
      this.waiting.delete(message.number);
      if (waiting) waiting(message);
    } else {
      this.on.text(message);
    }
  }

  closed() {
    for (const waiting of this.waiting.values()) waiting({ ok: false, message: 'the connection is closed' });
    this.waiting.clear();
    this.tries += 1;
    const gone = this.tries > 3;
    this.on.closed(gone ? 'The view has ended, or its token is an old one. Start canter view again and open its new address.'
      : 'The connection to the view is lost; trying again.', gone);
    setTimeout(() => this.connect(), gone ? 5000 : 700);
  }

  get isOpen() { return this.socket !== null && this.socket.readyState === WebSocket.OPEN; }

  /** Bytes that were sent and did not leave: more than none says that the link stands still. */
  get stalled() { return this.isOpen ? this.socket.bufferedAmount : Infinity; }

  /** Asks; the promise gives the answer with `ok` and `message`. */
  ask(wish) {
    if (!this.isOpen) return Promise.resolve({ ok: false, message: 'there is no connection' });
    this.number += 1;
    const number = this.number;
    this.socket.send(JSON.stringify({ number, ...wish }));
    return new Promise((resolve) => { this.waiting.set(number, resolve); });
  }
}
