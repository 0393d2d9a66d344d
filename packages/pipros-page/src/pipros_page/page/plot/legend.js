// The legend of a plot: a chip with the value of each curve, and the place of the cursor.

import { h, replace } from "../dom.js";
import { whyNoData } from "../why_no_data.js";
import { conditionOf, withCondition } from "./curve_text.js";

const LATE_MS = 3000; // a curve usually has data before

// `on.change(curve, changes)`, `on.remove(curve)` and `on.removeLine(value)` are called when the user clicks. Returns {element, draw}.
export function curveLegend(on, context) {
  const chips = h("div", { class: "bar legend" });
  const why = whyNoData(context);
  const element = h("div", {}, chips, why.element);
  let shown = "";
  let [without, timer] = ["", 0]; // a topic without data

  // Offers to find out why a topic has no data, once it has had time to send some.
  function offerLate(topic) {
    if (topic === without) return;
    without = topic;
    clearTimeout(timer);
    why.offer("");
    if (topic) timer = setTimeout(() => why.offer(topic), LATE_MS);
  }

  function chip(curve) {
    const swatch = h("b", { class: "swatch" });
    swatch.style.background = curve.colour;
    const toggle = (text, title, isOn, changes, label = null) => h("button", {
      class: "plain toggle", "aria-pressed": String(isOn), "aria-label": label, title, onclick: () => on.change(curve, changes),
    }, text);
    const condition = conditionOf(curve.field);
    const where = h("input", { hidden: true, size: 28, value: condition, placeholder: 'm.child_frame_id == "base_link"',
      spellcheck: "false", "aria-label": `Only messages of ${curve.topic} for which`,
      onchange: () => on.change(curve, { field: withCondition(curve.field, curve.topic, where.value.trim()) }) });
    const opener = h("button", { class: "plain toggle", "aria-pressed": String(Boolean(condition)), onclick: () => {
      where.hidden = !where.hidden;
      where.focus();
    }, title: "Only messages for which an expression over the message m is true" }, "where");
    return h("span", { class: "curve" }, swatch, h("span", {}),
      h("span", { class: "tools" }, toggle("d/dt", `Derivative of ${curve.field}`, curve.isRate, { isRate: !curve.isRate }),
      toggle("→|", "Right axis", curve.isRight, { isRight: !curve.isRight }, `Right axis of ${curve.field}`),
      opener, where), h("button", { class: "plain", "aria-label": `Remove ${curve.text}`, onclick: () => on.remove(curve) }, "×"));
  }

  const lineChip = (value) => h("span", { class: "curve" }, h("b", { class: "swatch line" }), `line ${value}`,
    h("button", { class: "plain", "aria-label": `Remove the line at ${value}`, onclick: () => on.removeLine(value) }, "×"));

  // Shows the values of the curves at a time, or the newest ones; `place` describes the cursor.
  function draw(curves, { time, place, isXy, lines }) {
    const texts = [...curves.map((curve) => `${curve.text} ${curve.colour}`), ...lines].join("\n");
    if (texts !== shown || !chips.childElementCount) replace(chips, curves.map(chip), lines.map(lineChip),
      curves.length ? h("span", { class: "key at" }) : null);
    shown = texts;
    curves.forEach((curve, index) => {
      const name = `${isXy && index === 0 ? "x: " : ""}${curve.field}${curve.isRate ? " d/dt" : ""}`;
      const text = `${name}: ${curve.textAt(time)}${curve.lost ? ` (${curve.lost} not shown)` : ""} ${curve.problem}`;
      const label = chips.children[index].children[1];
      if (label.textContent !== text) label.textContent = text;
    });
    if (curves.length) chips.lastChild.textContent = place;
    offerLate(curves.find((curve) => !curve.times.length)?.topic ?? "");
  }

  return { element, draw };
}
