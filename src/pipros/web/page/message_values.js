// Values of messages as text and as trees: the one place that formats them.

import { bytes, h } from "./dom.js";
import { placeOf } from "./place.js";

const MORE = "…"; // key of the entry that says how much of a value was left out
const FLOAT32_DIGITS = 7;

// A number as a person would write it: a float32 without the digits that its conversion to 64 bits added.
export function numberText(value) {
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
  if (isTime(value)) return h("span", {}, `${value.secs}.${String(value.nsecs).padStart(9, "0")} s`);
  return h("ul", { class: "tree" }, Object.entries(value).map(([key, item]) => entry(key, item, path && `${path}/${key}`)));
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
const entry = (key, value, path) => h("li", {},
  h("button", { class: "plain key", title: "Copy the value" }, `${key}:`), " ", tree(value, path));

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
