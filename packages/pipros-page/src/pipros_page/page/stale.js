// The state "stale": regular data has stopped. It has one word and one colour. The server decides it
// (web/stale.py); for reports between two updates and for messages that the browser receives, this module
// decides.

import { h } from "./dom.js";
import { silence } from "./silence.js";

const [LEAST_S, INTERVALS] = [3, 10]; // as in web/stale.py
const [REGULAR, KEPT] = [5, 20]; // number of times after which data are regular, and of those that determine their interval
export const LEVELS = ["OK", "Warning", "Error", "Stale"]; // names of the levels of diagnostics
const STALE_LEVEL = 3;

// Returns whether data that arrived every `intervalS` has stopped. `intervalS` is null if the interval is
// unknown.
export const isStale = (ageS, intervalS) => intervalS !== null && ageS > Math.max(LEAST_S, INTERVALS * intervalS);

export const ageText = (seconds) => (seconds < 10 ? `${seconds.toFixed(1)} s` : seconds < 120 ? `${seconds.toFixed(0)} s`
  : `${(seconds / 60).toFixed(0)} min`);

// The word in its colour; the age of the last data is its title.
export const staleMark = (ageS = null, text = "stale") => h("span", { class: "stale",
  title: ageS === null ? null : `The last data is ${ageText(ageS)} old` }, text);

export const LATCHED = "latched"; // instead of a rate: the newest message is kept for new subscribers, and no more are expected

// A rate or bandwidth, which is stale while the server is silent. "–" is none.
export const rateText = (text) => (silence.seconds && !text.startsWith("–") ? h("span", { class: "rate stale", "data-rate": text }, "stale")
  : h("span", { class: "rate" }, text));

// Updates all shown rates when the server has become silent, or answers again.
export function markRates() {
  for (const each of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".rate"))) {
    if (("rate" in each.dataset) !== Boolean(silence.seconds)) each.replaceWith(rateText(each.dataset.rate ?? each.textContent));
  }
}

// Recognizes gaps in data that arrive regularly.
export class Gaps {
  constructor() {
    this.times = []; // the last times (s) without a gap
  }

  // Notes a time. Returns whether it ends a gap.
  note(time) {
    const { times } = this;
    const interval = times.length > REGULAR ? (times.at(-1) - times[0]) / (times.length - 1) : null;
    const isGap = times.length > 0 && isStale(time - times.at(-1), interval);
    if (isGap || times.length > KEPT) times.splice(0, isGap ? times.length : 1);
    times.push(time);
    return isGap;
  }
}

// Returns the age of a component's report, and its level now. `data` is what the view of diagnostics sent.
export function levelNow({ last, level }, data) {
  const age = data.now - last;
  return { age, level: age > data.stale ? STALE_LEVEL : level };
}

export const isStaleLevel = (level) => level === STALE_LEVEL;

// The colour of a level with its first letter.
export const levelDot = (level) => h("span", { class: `dot lettered diagnostic-${level}`, title: LEVELS[level] ?? level },
  LEVELS[level]?.[0] ?? "?");
