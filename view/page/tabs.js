// Panels that share a place: one is shown.

export class Tabs {
  constructor(list) {
    this.buttons = [...list.querySelectorAll('[role="tab"]')];
    for (const button of this.buttons) {
      button.addEventListener('click', () => this.show(button.dataset.tab));
      button.addEventListener('keydown', (event) => this.key(event, button));
    }
    this.show(this.buttons[0].dataset.tab);
  }

  key(event, button) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    const next = this.buttons[(this.buttons.indexOf(button) + step + this.buttons.length) % this.buttons.length];
    this.show(next.dataset.tab);
    next.focus();
  }

  show(name) {
    this.shown = name;
    for (const button of this.buttons) {
      const chosen = button.dataset.tab === name;
      button.setAttribute('aria-selected', String(chosen));
      button.tabIndex = chosen ? 0 : -1;
      document.getElementById(button.dataset.tab).hidden = !chosen;
      if (chosen) delete button.dataset.news;
    }
    this.onshow?.(name);
  }

  /** Marks a panel that is not shown: it has something new. */
  mark(name, kind) {
    const button = this.buttons.find((found) => found.dataset.tab === name);
    if (button && this.shown !== name && button.dataset.news !== 'bad') button.dataset.news = kind;
  }
}
