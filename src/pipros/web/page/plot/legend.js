// The legend of a plot: a chip with the value of each curve, and the place of the cursor.

import { h, replace } from "../dom.js";
import { whyNoData } from "../why_no_data.js";

export const number = (value) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(7))));

// `on.change(curve, changes)` and `on.remove(curve)` are called when the user clicks. Returns {element, draw}.
export function curveLegend(on, context) {
  const chips = h("div", { class: "bar legend" });
  const why = whyNoData(context);
  const element = h("div", {}, chips, why.element);
  let shown = "";

  function chip(curve) {
    const swatch = h("b", { class: "swatch" });
    swatch.style.background = curve.colour;
    const toggle = (text, title, isOn, changes, label = null) => h("button", {
      class: "plain toggle", "aria-pressed": String(isOn), "aria-label": label, title, onclick: () => on.change(curve, changes),
    }, text);
    return h("span", { class: "curve" }, swatch, h("span", {}),
      toggle("d/dt", `Derivative of ${curve.field}`, curve.isRate, { isRate: !curve.isRate }),
      toggle("→|", "Right axis", curve.isRight, { isRight: !curve.isRight }, `Right axis of ${curve.field}`),
      h("button", { class: "plain", "aria-label": `Remove ${curve.text}`, onclick: () => on.remove(curve) }, "×"));
  }

  // Shows the values of the curves at a time, or the newest ones; `place` describes the cursor.
  function draw(curves, { time, place, isXy }) {
    const texts = curves.map((curve) => `${curve.text} ${curve.colour}`).join("\n");
    if (texts !== shown || !chips.childElementCount) replace(chips, curves.map(chip),
      curves.length ? h("span", { class: "key at" }) : null);
    shown = texts;
    curves.forEach((curve, index) => {
      const name = `${isXy && index === 0 ? "x: " : ""}${curve.field}${curve.isRate ? " d/dt" : ""}`;
      const text = `${name}: ${number(curve.at(time))}${curve.lost ? ` (${curve.lost} not shown)` : ""} ${curve.problem}`;
      const label = chips.children[index].children[1];
      if (label.textContent !== text) label.textContent = text;
    });
    if (curves.length) chips.lastChild.textContent = place;
    why.offer(curves.find((curve) => !curve.times.length)?.topic ?? "");
  }

  return { element, draw };
}
