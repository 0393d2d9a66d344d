// Time axes that move together: the zoom, the end, and the cursor of several plots.

export class TimeLink extends EventTarget {
  constructor() {
    super();
    this.isOn = true;
    this.ends = new Map(); // view to the times of its oldest and newest sample
  }

  // Notifies all plots of the user's action in one of them: {range: [from, to] or null} or {time: seconds or null}.
  tell(plot, change) {
    if (this.isOn) this.dispatchEvent(new CustomEvent("change", { detail: { plot, ...change } }));
  }

  // Calls `onChange({plot, range} or {plot, time})` when a plot calls `tell`, until the signal is aborted.
  listen(view, onChange, signal) {
    this.addEventListener("change", (event) => onChange(/** @type {CustomEvent} */ (event).detail), { signal });
    signal.addEventListener("abort", () => this.ends.delete(view));
  }

  // Forgets the samples of a view.
  forget(view) {
    this.ends.delete(view);
  }

  // Stores the times of a view's oldest and newest sample, and returns those of all views.
  range(view, oldest, newest) {
    this.ends.set(view, [oldest, newest]);
    if (!this.isOn) return [oldest, newest];
    const all = [...this.ends.values()];
    return [Math.min(...all.map(([first]) => first)), Math.max(...all.map(([, last]) => last))];
  }
}
