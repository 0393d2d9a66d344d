// What a tab is given: its subscriptions, which pause while it is hidden, and its part of the address.

import { live } from "./live.js";
import { placeOf } from "./place.js";

export class TabContext {
  // `onRemember(argument)` is called when the tab changes its address.
  constructor(name, control, onRemember) {
    this.name = name;
    this.control = control; // whether the page may change the system
    this.onRemember = onRemember;
    this.watches = new Set(); // {begin, stop, isAlways}
    this.isShown = true;
  }

  // Subscribes to a view, as live.watch does. With `always` the subscription continues while the tab is hidden.
  watch(view, args, onData, onError, { always = false } = {}) {
    const watch = { begin: () => live.watch(view, args, onData, onError), stop: null, isAlways: always };
    if (this.isShown || always) watch.stop = watch.begin();
    this.watches.add(watch);
    return () => {
      watch.stop?.();
      this.watches.delete(watch);
    };
  }

  act(action, args) {
    return live.act(action, args);
  }

  // Puts what the user chose in the tab into the address; Back returns to what it showed before.
  remember(argument) {
    this.onRemember(argument);
    const place = placeOf(this.name, argument);
    if (location.hash !== place) history.pushState(null, "", place);
  }

  hide() {
    this.isShown = false;
    for (const watch of this.watches) {
      if (watch.isAlways) continue;
      watch.stop?.();
      watch.stop = null;
    }
  }

  show() {
    this.isShown = true;
    for (const watch of this.watches) watch.stop ??= watch.begin();
  }

  close() {
    for (const watch of this.watches) watch.stop?.();
    this.watches.clear();
  }
}
