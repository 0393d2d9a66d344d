// Values of messages as text and as trees: the one place that formats them.

import { anglesOf, anglesText } from "./angles.js";
import { bytes, h } from "./dom.js";
import { placeOf } from "./place.js";

const MORE = "…"; // key of the entry with the full length of a shortened value
const NUMBER = "#"; // key of the text of a number that JSON lacks, or that JavaScript would round
const FLOAT32_DIGITS = 7;
const LONG_LIST = 10; // longer lists of messages are closed at first
const EARLIEST_WALL_S = 1e8; // smaller times are durations, or simulated
const clock = new Intl.DateTimeFormat("en-GB", { dateStyle: "short", timeStyle: "medium" });

// A number as a person would write it: a float32 without the digits that its conversion to 64 bits added.
export function numberText(value) {
  if (Object.is(value, -0)) return "-0.0";
  if (Number.isInteger(value) || Math.fround(value) !== value) return String(value);
  return String(Number(value.toPrecision(FLOAT32_DIGITS)));
}

const isTime = (value) => Number.isInteger(value.secs) && "nsecs" in value && Object.keys(value).length === 2;
const isLeaf = (value) => value === null || typeof value !== "object" || NUMBER in value;

// Shows a value as a tree. If the path of a topic and field is given, numbers link to their curves.
export function tree(value, path = "") {
  if (isLeaf(value)) return leaf(value, path);
  if (Array.isArray(value)) return list(value, path);
  if (MORE in value) return shortened(value, path);
  if (isTime(value)) return time(value);
  const fields = Object.entries(value).map(([key, item]) => entry(key, item, path && `${path}/${key}`));
  return isQuaternion(value) ? quaternion(value, fields, path) : h("ul", { class: "tree" }, fields);
}

const QUATERNION = ["x", "y", "z", "w"];
const ANGLES = ["roll", "pitch", "yaw"];
const isQuaternion = (value) => Object.keys(value).join() === QUATERNION.join() && QUATERNION.every((key) => Number.isFinite(value[key]));

// The angles stand beside a quaternion, but are not copied with it.
function quaternion(value, fields, path) {
  const angles = anglesOf(value);
  const shown = angles?.map((angle, index) => [index ? ", " : "", path
    ? h("a", { class: "number", href: placeOf("plot", `${path}/${ANGLES[index]}_deg`), title: `Plot the ${ANGLES[index]}` },
      anglesText([angle])) : anglesText([angle])]);
  return h("ul", { class: "tree", "data-text": QUATERNION.map((key) => `${key}: ${value[key]}`).join("\n") }, fields,
    angles ? h("li", { "data-key": "angles" }, h("span", { class: "key" }, `${ANGLES.join(", ")}: `), h("span", {}, shown)) : null);
}

const COVARIANCE = /covariance$/;

// Returns a short text for a covariance matrix: the standard deviations from its diagonal; empty for other values.
export function covarianceText(key, value) {
  const size = Array.isArray(value) ? Math.sqrt(value.length) : 0;
  if (!COVARIANCE.test(key) || size < 2 || !Number.isInteger(size) || !value.every((each) => typeof each === "number")) return "";
  const deviations = Array.from({ length: size }, (_, index) => Math.sqrt(value[index * (size + 1)]));
  if (value.every((each) => each === 0)) return `${size} × ${size}, zero`;
  return `${size} × ${size}, σ ${deviations.map((each) => (Number.isFinite(each) ? String(Number(each.toPrecision(3))) : "–")).join(" ")}`;
}

function time({ secs, nsecs }) {
  const text = `${secs}.${String(nsecs).padStart(9, "0")}`;
  return h("span", { "data-text": text }, `${text} s`, secs > EARLIEST_WALL_S
    ? h("span", { class: "key" }, ` ${clock.format(secs * 1000)}`) : null);
}

function leaf(value, path) {
  if (typeof value === "string") return h("span", { "data-text": value }, JSON.stringify(value));
  const text = value?.[NUMBER] ?? (typeof value === "number" ? numberText(value) : null);
  if (text === null || !path) return h("span", {}, text ?? String(value));
  return h("a", { class: "number", href: placeOf("plot", path), title: `Plot ${path}` }, text);
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
  const folded = covarianceText(key, value);
  if (folded) return h("li", { "data-key": key }, name, h("details", { class: "below-name" },
    h("summary", { class: "key", "aria-label": `${folded}: values of ${key}` }, folded), shown));
  if (!shown.matches("ul")) return h("li", { "data-key": key }, name, " ", shown);
  const size = Array.isArray(value) ? `${value.length} elements` : "";
  const isOpen = shown.childElementCount <= LONG_LIST || !Array.isArray(value);
  return h("li", { "data-key": key }, name, h("details", { class: "below-name", open: isOpen },
    h("summary", { class: "key", "aria-label": `Fields of ${key}` }, size), shown));
}

// Returns at most `most` numbers of a message with the paths of their fields, without headers: [["linear/x", 0.5], …]. Integers
// beyond 2^53 are rounded.
export function numbersIn(value, most, path = "") {
  if (typeof value === "number") return [[path, value]];
  if (value?.[NUMBER]) return [[path, Number(value[NUMBER].replace("inf", "Infinity"))]];
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
