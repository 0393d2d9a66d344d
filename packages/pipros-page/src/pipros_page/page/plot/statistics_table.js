// A table with the statistics of curves.

import { h, hertz, morph } from "../dom.js";
import { number, statistics } from "./selection.js";

const HEADS = ["Curve", "Samples", "Least", "Largest", "Mean", "Deviation", "Change", "Rate"];

// Returns {element, draw(curves, range)}; a range of null means all samples.
export function statisticsTable() {
  const element = h("div", { class: "statistics", role: "region", "aria-label": "Statistics of the shown part", tabindex: 0, hidden: true },
    h("table", {}));

  function draw(curves, range) {
    morph(element.firstChild, h("table", {}, h("thead", {}, h("tr", {}, HEADS.map((each, index) =>
      h("th", { class: index ? "number" : "" }, each)))), h("tbody", {}, curves.map((curve) => rowOf(curve, range)))));
  }

  return { element, draw };
}

function rowOf(curve, range) {
  const found = statistics(curve, range);
  const { count = 0, least, most, mean, deviation, change, rate = null } = found ?? {};
  return h("tr", { "data-key": curve.text }, h("td", {}, curve.text), h("td", { class: "number" }, String(count)),
    [least, most, mean, deviation, change].map((value) => h("td", { class: "number" }, number(value))),
    h("td", { class: "number" }, hertz(rate)));
}
