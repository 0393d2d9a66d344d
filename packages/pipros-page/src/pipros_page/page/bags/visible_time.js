// The part of a bag's time that the timeline shows.

const SHORTEST_S = 0.5; // minimum visible time
const MAX_TICKS = 6;
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400, 43200, 86400];

export class VisibleTime {
  // From `begin` to `end`, in seconds.
  constructor(begin, end) {
    this.begin = begin;
    this.duration = Math.max(end - begin, 1e-9);
    this.first = begin;
    this.span = this.duration;
  }

  // Shows a part of the time, shifted or shortened to fit into the bag. Returns whether this is a change.
  show(begin, length) {
    const span = Math.min(this.duration, Math.max(Math.min(SHORTEST_S, this.duration), length));
    const first = Math.min(this.begin + this.duration - span, Math.max(this.begin, begin));
    if (this.first === first && this.span === span) return false;
    [this.first, this.span] = [first, span];
    return true;
  }

  // Zooms so that `time` stays at its place.
  zoom(factor, time) {
    return this.show(time - (time - this.first) * Math.min(factor, this.duration / this.span), this.span * factor);
  }

  // Moves so that `time` is visible.
  follow(time) {
    return (time < this.first || time > this.first + this.span) && this.show(time - this.span / 10, this.span);
  }

  // Returns where `time` is, as text for a style.
  percent(time) {
    return `${(100 * (time - this.first)) / this.span}%`;
  }

  // Returns the width of `duration`, as text for a style.
  width(duration) {
    return `${(100 * duration) / this.span}%`;
  }

  // Returns at most six round times, in seconds from the beginning of the bag.
  ticks() {
    const [from, to] = [this.first - this.begin, this.first + this.span - this.begin];
    const step = STEPS_S.find((each) => (to - from) / each < MAX_TICKS) ?? (to - from) / MAX_TICKS;
    const first = Math.ceil(from / step);
    return Array.from({ length: Math.max(0, Math.ceil(to / step) - first) }, (_, index) => (first + index) * step);
  }

  // Returns `count` times at equal distances.
  spread(count) {
    return Array.from({ length: count }, (_, at) => this.first + ((at + 0.5) * this.span) / count);
  }
}
