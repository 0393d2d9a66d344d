// Live view of one topic: statistics, the newest message as a tree, a gauge for a percentage, a curve of one number.

import { copiesValues, copyButton } from "./copy.js";
import { bandwidth, bytes, h, hertz, morph, panelHead, problemLine, replace, s } from "./dom.js";
import { tree } from "./message_values.js";
import { nodeText } from "./node_text.js";
import { smallCurve } from "./small_curve.js";
import { LATCHED, ageText, rateText, staleMark } from "./stale.js";
import { topicPicture } from "./topic_picture.js";
import { whyNoData } from "./why_no_data.js";

// Fills `side`; returns a function that stops the updates.
export function topicPanel(side, name, context, onClose) {
  const figures = h("div", {}, h("dl", {}));
  const gauge = h("div", {});
  const curve = smallCurve();
  const picture = topicPicture();
  const error = problemLine("p");
  const message = copiesValues(h("div", { class: "message" }, h("div", {})), error.show);
  const copy = (title) => copyButton(title, () => context.act("message_text", { name, format: title.toLowerCase() }), error.show);
  const why = whyNoData(context);
  const definitionText = h("pre", { class: "mono whole" });
  let definedType = ""; // the type whose definition is shown
  let type = ""; // the topic's type; empty until it is known
  const definition = h("details", { class: "definition", ontoggle: () => define() }, h("summary", {}, "Definition"), definitionText);

  const ask = context.newest();
  async function define() {
    if (!definition.open || !type || type === definedType) return;
    definedType = type;
    try {
      replace(definitionText, await ask("definition", { name }));
    } catch (problem) {
      replace(definitionText, problem.message);
    }
  }

  side.append(panelHead(name, onClose), figures, error.element, why.element, gauge, picture.element, curve.element, definition,
    h("div", { class: "panel-head" }, h("h3", {}, "Newest message"), h("span", { class: "buttons" }, copy("YAML"), copy("JSON"))), message);

  return context.watch("topic", { name }, (topic) => {
    morph(figures.firstChild, h("dl", {}, figuresOf(topic).map(([key, value]) => [h("dt", {}, key), h("dd", {}, value)])));
    error.show(topic.error ?? "");
    why.offer(topic.rate === null || !topic.count ? name : "");
    type = topic.type;
    define();
    if (!("message" in topic)) {
      const text = topic.count ? "cannot be decoded" : topic.publishers.length ? "none received yet" : "no node publishes this topic";
      if (!topic.count || topic.error) morph(message.firstChild, h("div", {}, h("span", { class: "key" }, text)));
      return;
    }
    morph(message.firstChild, h("div", {}, tree(topic.message, name)));
    const percent = topic.gauge ?? null;
    if (percent === null) replace(gauge); // the gauge of an older message would be wrong
    else drawGauge(gauge, percent);
    picture.take(topic.picture);
    if (topic.picture) curve.element.hidden = true; // a picture shows more than a curve of the first number
    else curve.take(topic.message, percent);
  }, error.show);
}

const figuresOf = (topic) => [
  ["Type", topic.type || "unknown"],
  ...(topic.wrong ? [["Wrong type", h("span", { class: "wrong-type" }, topic.wrong)]] : []),
  ["Rate", topic.stale ? [staleMark(), `: the last message is ${ageText(topic.stale)} old`] : topic.latched && !topic.rate ? LATCHED
    : rateText(hertz(topic.rate))],
  ["Bandwidth", rateText(bandwidth(topic.bandwidth))],
  ["Size", bytes(topic.size ?? topic.bytes)],
  ["Messages", String(topic.count)],
  ["Publishers", topic.publishers.map(nodeText).join(", ") || "none"],
  ["Subscribers", topic.subscribers.map(nodeText).join(", ") || "none"],
];

function drawGauge(element, percent) {
  const level = percent <= 10 ? "critical" : percent <= 25 ? "low" : "";
  let charge = element.querySelector(".charge");
  if (!charge) {
    charge = s("rect", { class: "charge", x: 6, y: 6, width: 0, height: 32, rx: 3 });
    replace(element, h("div", { class: "gauge", role: "meter", "aria-label": "Level", "aria-valuemin": 0, "aria-valuemax": 100 },
      s("svg", { viewBox: "0 0 96 44", "aria-hidden": "true" }, s("rect", { class: "shell", x: 2, y: 2, width: 84, height: 40, rx: 6 }),
        s("rect", { class: "cap", x: 88, y: 14, width: 6, height: 16, rx: 2 }), charge),
      h("span", { class: "value" })));
  }
  charge.setAttribute("class", `charge ${level}`);
  charge.setAttribute("width", (76 * percent) / 100);
  element.firstChild.setAttribute("aria-valuenow", percent);
  replace(element.querySelector(".value"), `${Math.round(percent * 10) / 10} %`);
}
