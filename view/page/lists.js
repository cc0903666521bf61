// Lists of poses: a table, of which one row is shown.

const get = (id) => document.getElementById(id);
const seconds = (value) => (value === null ? '' : `${value.toFixed(3)} s`);

/** The cells of a row, and what each says. */
const cells = ({ name, poses, motion_s: motion, stop_s: stop, reason }) => [
  [name, 'name'],
  [String(poses), 'poses'],
  [reason ? 'no motion' : seconds(motion), reason || 'time of the motion'],
  [stop === null || motion === null ? '' : (motion / stop).toFixed(3), 'part of the time with a stop at each pose'],
];

/** What the columns are. */
function head() {
  const item = document.createElement('li');
  item.className = 'head';
  item.append(...['list', 'poses', 'time', 'of stop'].map((text) => {
    const cell = document.createElement('span');
    cell.textContent = text;
    return cell;
  }));
  return item;
}

export class Lists {
  /** `ask` asks the server for a list. */
  constructor(ask) {
    this.ask = ask;
    this.chosen = -1;
    this.buttons = [];
  }

  set({ lists }) {
    document.body.dataset.lists = 'yes';
    get('program-name').textContent = `${lists.length} lists of poses`;
    this.buttons = lists.map((list, index) => {
      const button = document.createElement('button');
      button.append(...cells(list).map(([text, title]) => {
        const cell = document.createElement('span');
        cell.textContent = text;
        cell.title = title;
        return cell;
      }));
      button.disabled = list.reason !== null;
      button.addEventListener('click', () => this.choose(index));
      return button;
    });
    get('lists').hidden = false;
    get('lists').replaceChildren(head(), ...this.buttons.map((button) => {
      const item = document.createElement('li');
      item.append(button);
      return item;
    }));
    const first = lists.findIndex((list) => list.reason === null);
    if (first >= 0) this.choose(first);
  }

  choose(index) {
    this.chosen = index;
    for (const [at, button] of this.buttons.entries()) button.setAttribute('aria-pressed', String(at === index));
    this.ask({ do: 'list', index });
  }
}
