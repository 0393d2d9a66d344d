// The curves and marks of a plot, and where their samples come from: the running system, the moment of a bag, or a whole bag.

import { playback } from "../bags/playback.js";
import { Curve } from "./curve.js";
import { curveText } from "./curve_text.js";

const MAX_MARKS = 2000;

export class CurveSet {
  // `on.change()` is called when there are new samples, `on.fields(curve, fields)` if a curve's field is not a number but
  // contains numbers.
  constructor(context, on) {
    this.context = context;
    this.on = on;
    this.curves = new Map(); // text to Curve
    this.marks = []; // [time, level, text]
    this.closeMarks = () => {};
    this.axis = "received";
    this.hasMarks = false;
    this.wantsWhole = false;
  }

  get all() {
    return [...this.curves.values()];
  }

  get isXy() {
    return this.axis === "xy";
  }

  // The kind of time that the samples have.
  get times() {
    return this.isXy ? "received" : this.axis;
  }

  get isWhole() {
    return this.wantsWhole && Boolean(playback.bag);
  }

  get oldest() {
    return this.all.reduce((first, curve) => Math.min(first, curve.times[0] ?? Infinity), Infinity);
  }

  get newest() {
    return this.all.reduce((last, curve) => Math.max(last, curve.times.at(-1) ?? 0), 0);
  }

  watch(names, args, onData, onError) {
    const [live, whole] = names;
    const more = { axis: this.times, ...(this.isWhole ? { name: playback.name } : {}) };
    return this.context.watch(this.isWhole ? whole : live, { ...args, ...more }, onData, onError, { always: true });
  }

  add(text) {
    if (this.curves.has(text)) return;
    const taken = this.all.map((curve) => curve.hue);
    let hue = 0;
    while (taken.includes(hue)) hue += 1;
    const curve = new Curve(text, hue);
    this.curves.set(text, curve);
    this.follow(curve);
  }

  drop(text) {
    this.curves.get(text).close();
    this.curves.delete(text);
  }

  // Changes whether a curve is a derivative, or on the right axis; it keeps its place and colour.
  change(curve, changes) {
    const changed = new Curve(curveText({ ...curve, ...changes }), curve.hue);
    if (this.curves.has(changed.text)) return;
    const entries = this.all.map((each) => (each === curve ? changed : each));
    curve.close();
    this.curves.clear();
    for (const each of entries) this.curves.set(each.text, each);
    this.follow(changed);
  }

  // Requests the samples of a curve, from the beginning.
  follow(curve) {
    curve.close();
    curve.forget();
    curve.close = this.watch(["plot", "bag_curve"], { field: curve.field }, (data) => {
      curve.take(data);
      if (data.fields?.length && !curve.times.length && this.curves.has(curve.text)) this.on.fields(curve, data.fields);
      this.on.change();
    }, (problem) => { curve.problem = problem; this.on.change(); });
  }

  followMarks() {
    this.closeMarks();
    this.closeMarks = () => {};
    this.marks = [];
    if (!this.hasMarks) return;
    this.closeMarks = this.watch(["log_marks", "bag_marks"], {}, (data) => {
      this.marks = [...this.marks, ...data.marks].slice(-MAX_MARKS);
      this.on.change();
    });
  }

  // Requests everything again: from another source, or with other times.
  restart() {
    for (const curve of this.all) this.follow(curve);
    this.followMarks();
  }

  forget() {
    for (const curve of this.all) curve.forget();
    this.marks = [];
  }
}
