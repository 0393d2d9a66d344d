// One curve: its samples, which come from the running system, the moment of a bag, or a whole bag.

import { Gaps } from "../stale.js";
import { parsedCurve, topicBefore } from "./curve_text.js";
import { firstFrom, number as numberText } from "./selection.js";

const KEPT_POINTS = 50000;
const LIGHT = ["#2f6fb3", "#c0392b", "#1a7f37", "#9a6700", "#7d4cdb", "#00838f", "#ad1457", "#5d6d7e"];
const DARK = ["#6ba7e8", "#f2867b", "#62c283", "#dcae4a", "#b394f4", "#4dc4d0", "#f28ab8", "#a9b6c3"];
const dark = matchMedia("(prefers-color-scheme: dark)");

export class Curve {
  // `hue` is a number: the first ones have chosen colours, and the others turn by the golden angle.
  constructor(text, hue) {
    const { field, isRate, isRight } = parsedCurve(text);
    this.field = field;
    this.isRate = isRate;
    this.isRight = isRight;
    this.text = text;
    this.hue = hue;
    this.problem = "";
    this.topic = guessedTopic(field); // the server replaces it once it knows the topic
    this.close = () => {};
    this.forget();
  }

  get colour() {
    return (dark.matches ? DARK : LIGHT)[this.hue] ?? `hsl(${(this.hue * 137.508) % 360} 60% ${dark.matches ? 70 : 38}%)`;
  }

  forget() {
    this.times = [];
    this.values = [];
    this.exact = new Map(); // by time, the texts of integers that the curve rounds
    this.gaps = new Gaps();
    this.lost = 0;
    this.last = null; // the last time and number, from which the derivative is computed
  }

  // Adds samples in the server's format.
  take({ samples = [], lost = 0, error = "", topic = this.topic }) {
    this.topic = topic;
    this.problem = error;
    this.lost += lost;
    for (const [time, number, exact] of samples) {
      const before = this.times.at(-1);
      if (before !== undefined && time < before) continue;
      if (this.gaps.note(time)) this.interrupt((before + time) / 2);
      const value = this.isRate ? this.rate(time, number) : number;
      if (value === undefined) continue;
      this.times.push(time);
      this.values.push(value);
      if (exact && !this.isRate) this.exact.set(time, exact);
    }
    if (this.times.length > KEPT_POINTS * 1.2) this.trim();
  }

  trim() {
    this.times = this.times.slice(-KEPT_POINTS);
    this.values = this.values.slice(-KEPT_POINTS);
    for (const time of this.exact.keys()) if (time < this.times[0]) this.exact.delete(time);
  }

  interrupt(time) {
    this.times.push(time);
    this.values.push(null);
    this.last = null;
  }

  // The derivative since the last sample: null beside a gap, undefined for the first sample or if no time has passed.
  rate(time, number) {
    const { last } = this;
    if (last && time <= last.time) return undefined;
    this.last = { time, number };
    if (!last) return undefined;
    return last.number === null || number === null ? null : (number - last.number) / (time - last.time);
  }

  // The index of the newest sample at or before a time; if the time is null, of the newest of all.
  indexOf(time) {
    return time === null ? this.values.length - 1 : newestAt(this.times, time);
  }

  at(time) {
    return this.values[this.indexOf(time)];
  }

  textAt(time) {
    const exact = this.exact.get(this.times[this.indexOf(time)]);
    return exact ? `${exact} (the curve is rounded)` : numberText(this.at(time));
  }
}

// Guesses the topic of a field while the server does not know it: the field is usually one level below.
const guessedTopic = (field) => (/[={]/.test(field) ? topicBefore(field) : field.replace(/(?<=.)\/[^/]*$/, ""));

// The index of the newest sample at or before a time.
const newestAt = (times, time) => firstFrom(times, time, (each) => each <= time) - 1;

// The value of a curve at a time, interpolated; null beside a gap, undefined outside of its samples.
function between({ times, values }, time) {
  const index = newestAt(times, time);
  if (times[index] === time) return values[index];
  if (index < 0 || index === times.length - 1) return undefined;
  if (values[index] === null || values[index + 1] === null) return null;
  const part = (time - times[index]) / (times[index + 1] - times[index]);
  return values[index] + part * (values[index + 1] - values[index]);
}

// The values of one curve over the values of another, between two times: [[x, y, time], …] with null at gaps.
export function pairs(over, curve, [begin, end]) {
  const found = [];
  for (let index = Math.max(0, newestAt(curve.times, begin)); index < curve.times.length && curve.times[index] <= end; index += 1) {
    const x = between(over, curve.times[index]);
    if (x !== undefined) found.push(x === null || curve.values[index] === null ? null : [x, curve.values[index], curve.times[index]]);
  }
  return found;
}
