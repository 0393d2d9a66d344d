// Live view of one topic: statistics, the newest message as a tree, a gauge for a percentage, a curve of the first number.

import { bandwidth, bytes, h, hertz, morph, panelHead, replace, s } from "./dom.js";
import { placeOf } from "./place.js";

const CURVE_POINTS = 300;
const MORE = "…";

export function topicPanel(side, name, context, onClose) {
  const figures = h("div", {}, h("dl", {}));
  const gauge = h("div", {});
  const curve = h("div", {});
  const message = h("div", { class: "message" }, h("div", {}));
  const error = h("p", { class: "error", role: "alert" });
  side.append(panelHead(name, onClose), figures, error, gauge, curve, h("h3", {}, "Newest message"), message);
  const values = [];
  let path = null;
  return context.watch("topic", { name }, (topic) => {
    morph(figures.firstChild, h("dl", {}, Object.entries({
      Type: topic.type || "unknown", Rate: hertz(topic.rate), Bandwidth: bandwidth(topic.bandwidth),
      Size: bytes(topic.size), Messages: String(topic.count),
      Publishers: topic.publishers.join(", ") || "none", Subscribers: topic.subscribers.join(", ") || "none",
    }).map(([key, value]) => [h("dt", {}, key), h("dd", {}, value)])));
    replace(error, topic.error ?? "");
    if (!("message" in topic)) {
      if (!topic.count) morph(message.firstChild, h("div", {}, h("span", { class: "key" }, "none came yet")));
      return;
    }
    morph(message.firstChild, h("div", {}, tree(topic.message, name)));
    if (topic.gauge !== null && topic.gauge !== undefined) drawGauge(gauge, topic.gauge);
    else replace(gauge); // the gauge of an older message would be wrong
    const found = path ? numberAt(topic.message, path) : null;
    if (!path) path = firstNumber(topic.message);
    const value = topic.gauge ?? found ?? (path ? numberAt(topic.message, path) : null);
    if (typeof value === "number") {
      values.push(value);
      if (values.length > CURVE_POINTS) values.shift();
      drawCurve(curve, values, topic.gauge !== null && topic.gauge !== undefined ? "percentage" : path.join("."));
    }
  }, (text) => replace(error, text));
}

// Shows a value as a tree. If the path of a topic and field is given, numbers link to their curves.
export function tree(value, path = "") {
  if (typeof value === "number" && path) return h("a", { class: "number", href: placeOf("plot", path), title: `Plot ${path}` }, String(value));
  if (value === null || typeof value !== "object") return h("span", {}, typeof value === "string" ? JSON.stringify(value) : String(value));
  if (Array.isArray(value)) return h("ul", { class: "tree" }, value.map((item, index) => entry(`[${index}]`, item, path && `${path}[${index}]`)));
  if (MORE in value) {
    if ("hex" in value) return h("span", {}, `${bytes(value[MORE])}: ${value.hex}${value[MORE] * 3 > value.hex.length + 1 ? " …" : ""}`);
    return h("span", {}, `${value[MORE]} elements, the first ${value.items.length}:`, tree(value.items, path));
  }
  if ("secs" in value && "nsecs" in value && Object.keys(value).length === 2) return h("span", {}, `${value.secs}.${String(value.nsecs).padStart(9, "0")} s`);
  return h("ul", { class: "tree" }, Object.entries(value).map(([key, item]) => entry(key, item, path && `${path}/${key}`)));
}

function entry(key, value, path) {
  if (Array.isArray(value) && value.every((item) => item === null || typeof item !== "object")) {
    return h("li", {}, h("span", { class: "key" }, `${key}: `), `[${value.map((item) => (typeof item === "string" ? JSON.stringify(item) : item)).join(", ")}]`);
  }
  return h("li", {}, h("span", { class: "key" }, `${key}: `), tree(value, path));
}

function firstNumber(value, path = []) {
  if (typeof value === "number") return path;
  if (value === null || typeof value !== "object" || MORE in value || "nsecs" in value) return null;
  for (const [key, item] of Object.entries(value)) {
    if (key === "header" || key === "seq") continue;
    const found = firstNumber(item, [...path, key]);
    if (found) return found;
  }
  return null;
}

const numberAt = (value, path) => {
  const found = path.reduce((part, key) => part?.[key], value);
  return typeof found === "number" ? found : null;
};

function drawGauge(element, percent) {
  const level = percent <= 10 ? "critical" : percent <= 25 ? "low" : "";
  let charge = element.querySelector(".charge");
  if (!charge) {
    charge = s("rect", { class: "charge", x: 6, y: 6, width: 0, height: 32, rx: 3 });
    replace(element, h("div", { class: "gauge", role: "meter", "aria-label": "Level", "aria-valuemin": 0, "aria-valuemax": 100 },
      s("svg", { viewBox: "0 0 96 44", "aria-hidden": "true" }, s("rect", { class: "shell", x: 2, y: 2, width: 84, height: 40, rx: 6 }), s("rect", { class: "cap", x: 88, y: 14, width: 6, height: 16, rx: 2 }), charge),
      h("span", { class: "value" })));
  }
  charge.setAttribute("class", `charge ${level}`);
  charge.setAttribute("width", (76 * percent) / 100);
  element.firstChild.setAttribute("aria-valuenow", percent);
  replace(element.querySelector(".value"), `${Math.round(percent * 10) / 10} %`);
}

function drawCurve(element, values, title) {
  let line = element.querySelector("path");
  if (!line) {
    line = s("path", {});
    replace(element, h("h3", {}, title), s("svg", { class: "spark", viewBox: "0 0 300 60", preserveAspectRatio: "none", role: "img", "aria-label": `Curve of ${title}` }, line), h("div", { class: "key range" }));
  }
  const low = Math.min(...values);
  const high = Math.max(...values);
  const points = values.map((value, index) => `${values.length > 1 ? (index * 300) / (values.length - 1) : 0},${high > low ? 57 - ((value - low) / (high - low)) * 54 : 30}`);
  line.setAttribute("d", `M${points.join("L")}`);
  replace(element.querySelector(".range"), `${low} to ${high}, newest ${values.at(-1)}`);
}
