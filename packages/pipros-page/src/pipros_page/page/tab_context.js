// The context of a tab: its subscriptions, which pause while the tab is hidden, and its part of the address.

import { live } from "./live.js";
import { currentPlace, placeOf } from "./place.js";
import { afterPress } from "./press.js";

const HANDLES = "scene"; // the view whose content can be dragged, and which is therefore updated during a press, too

export class TabContext {
  // `onRemember(argument)` is called when the tab changes its address.
  constructor(name, control, onRemember) {
    this.name = name;
    this.control = control; // whether the page may change the system
    this.onRemember = onRemember;
    this.watches = new Set(); // {begin, stop, isAlways}
    this.isShown = true;
    this.times = null; // links the time axis to those of other panels
    this.onShown = (_isShown) => {}; // called when the tab is shown or hidden
    this.ending = new AbortController();
  }

  // Aborted when the view is closed: for listeners outside of it.
  get signal() {
    return this.ending.signal;
  }

  // Whether a key that was pressed anywhere on the page is meant for this view.
  hears(_event) {
    return this.isShown;
  }

  // Subscribes to a view, as live.watch does. With `always` the subscription continues while the tab is hidden.
  watch(view, args, onData, onError, { always = false } = {}) {
    const begin = () => {
      let isOpen = true;
      const take = (data) => { if (isOpen) onData(data); };
      const isImmediate = this.name === HANDLES;
      const stop = live.watch(view, args, (data) => {
        if (isImmediate || data instanceof DataView) take(data);
        else afterPress(() => take(data));
      }, onError);
      return () => {
        isOpen = false;
        stop();
      };
    };
    const watch = { begin, stop: null, isAlways: always };
    if (this.isShown || always) watch.stop = watch.begin();
    this.watches.add(watch);
    return () => {
      watch.stop?.();
      this.watches.delete(watch);
    };
  }

  // Calls `forget` when messages begin to come from another source, or another moment of a bag.
  onSource(forget) {
    live.addEventListener("source", forget, { signal: this.signal });
  }

  act(action, args) {
    return live.act(action, args);
  }

  // Returns an `act` for answers that replace one another: an answer that comes after the next question is dropped.
  newest() {
    let last = null;
    return (action, args) => new Promise((resolve, reject) => {
      const asked = last = this.act(action, args);
      asked.then((answer) => { if (asked === last) resolve(answer); }, (problem) => { if (asked === last) reject(problem); });
    });
  }

  // Puts the user's choice in the tab into the address. Back returns to the previous choice, unless `isReplacing`.
  remember(argument, { isReplacing = false } = {}) {
    this.onRemember(argument);
    const [shown] = currentPlace(); // the next tab, while its module is being loaded
    if (!this.isShown || (shown && shown !== this.name)) return; // data arrived for a hidden tab
    const place = placeOf(this.name, argument);
    if (isReplacing) history.replaceState(null, "", place);
    else if (location.hash !== place) history.pushState(null, "", place);
  }

  hide() {
    this.isShown = false;
    for (const watch of this.watches) {
      if (watch.isAlways) continue;
      watch.stop?.();
      watch.stop = null;
    }
    this.onShown(false);
  }

  show() {
    this.isShown = true;
    for (const watch of this.watches) watch.stop ??= watch.begin();
    this.onShown(true);
  }

  close() {
    this.ending.abort();
    for (const watch of this.watches) watch.stop?.();
    this.watches.clear();
  }
}
