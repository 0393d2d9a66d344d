// Values of messages as text and as trees: the one place that formats them.

import { bytes, h } from "./dom.js";
import { placeOf } from "./place.js";

const MORE = "…"; // key of the entry that states how much of a value was left out
const FLOAT32_DIGITS = 7;
const LONG_LIST = 10; // longer lists of messages are closed at first
const EARLIEST_WALL_S = 1e8; // smaller times are durations, or simulated
const clock = new Intl.DateTimeFormat("en-GB", { dateStyle: "short", timeStyle: "medium" });

// A number as a person would write it: a float32 without the digits that its conversion to 64 bits added.
function numberText(value) {
  if (Number.isInteger(value) || Math.fround(value) !== value) return String(value);
  return String(Number(value.toPrecision(FLOAT32_DIGITS)));
}

const isTime = (value) => "secs" in value && "nsecs" in value && Object.keys(value).length === 2;
const isLeaf = (value) => value === null || typeof value !== "object";

// Shows a value as a tree. If the path of a topic and field is given, numbers link to their curves.
export function tree(value, path = "") {
  if (isLeaf(value)) return leaf(value, path);
  if (Array.isArray(value)) return list(value, path);
  if (MORE in value) return shortened(value, path);
  if (isTime(value)) return time(value);
  return h("ul", { class: "tree" }, Object.entries(value).map(([key, item]) => entry(key, item, path && `${path}/${key}`)));
}

function time({ secs, nsecs }) {
  const text = `${secs}.${String(nsecs).padStart(9, "0")}`;
  return h("span", { "data-text": text }, `${text} s`, secs > EARLIEST_WALL_S
    ? h("span", { class: "key" }, ` ${clock.format(secs * 1000)}`) : null);
}

function leaf(value, path) {
  if (typeof value === "string") return h("span", { "data-text": value }, JSON.stringify(value));
  if (typeof value !== "number") return h("span", {}, String(value));
  if (!path) return h("span", {}, numberText(value));
  return h("a", { class: "number", href: placeOf("plot", path), title: `Plot ${path}` }, numberText(value));
}

function list(values, path) {
  const items = values.map((item, index) => [item, path && `${path}[${index}]`]);
  if (!values.every(isLeaf)) return h("ul", { class: "tree" }, items.map(([item, own], index) => entry(`[${index}]`, item, own)));
  return h("span", {}, "[", items.map(([item, own], index) => [index ? ", " : "", leaf(item, own)]), "]");
}

function shortened(value, path) {
  if ("hex" in value) {
    const isWhole = value[MORE] * 3 <= value.hex.length + 1;
    return h("span", {}, `${bytes(value[MORE])}: ${value.hex}${isWhole ? "" : " …"}`);
  }
  return h("span", {}, `${value[MORE]} elements, the first ${value.items.length}: `, tree(value.items, path));
}

// The name of a field is a button that copies its value: see `copiesValues` in copy.js.
function entry(key, value, path) {
  const name = h("button", { class: "plain key", title: "Copy the value" }, `${key}:`);
  const shown = tree(value, path);
  if (!shown.matches("ul")) return h("li", { "data-key": key }, name, " ", shown);
  const size = Array.isArray(value) ? `${value.length} elements` : "";
  const isOpen = shown.childElementCount <= LONG_LIST || !Array.isArray(value);
  return h("li", { "data-key": key }, name, h("details", { class: "below-name", open: isOpen },
    h("summary", { class: "key", "aria-label": `Fields of ${key}` }, size), shown));
}

// The numbers of a message with the paths of their fields, without headers: [["linear.x", 0.5], …].
export function numbersIn(value, most, path = "") {
  if (typeof value === "number") return [[path, value]];
  if (isLeaf(value) || isTime(value)) return [];
  const items = MORE in value ? value.items ?? [] : value;
  const found = [];
  for (const [key, item] of Object.entries(items)) {
    if (found.length >= most) break;
    if (key === "header" || key === "seq") continue;
    const own = Array.isArray(items) ? `${path}[${key}]` : path ? `${path}/${key}` : key;
    found.push(...numbersIn(item, most - found.length, own));
  }
  return found;
}
