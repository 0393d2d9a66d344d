// Layouts of panels: trees of views, as values and as text for addresses and files.
//
// A leaf is {id, tab, argument}; a split is {direction: "row" | "column", parts, sizes}, whose sizes add up to 100.
// In text: row(plot//imu/x*60~column(images//camera~console)*40). The numbers are sizes; parts without one get the average.

import { completed } from "../place.js";

const DEEPEST = 20;
export const MAX_PANELS = 16;
const SMALLEST = 5; // percent of a split
const SIGNS = /[!()~*]/g; // the syntax of layouts; in arguments, these are escaped

let nextId = 1;
export const leaf = (tab, argument = "") => ({ id: nextId++, tab, argument });

// The leaves in reading order.
export const leavesOf = (layout) => (layout ? layout.parts?.flatMap(leavesOf) ?? [layout] : []);

const escaped = (text) => text.replace(SIGNS, (sign) => `!${sign.charCodeAt(0).toString(16)}`);
const unescaped = (text) => text.replace(/!([0-9a-f]{2})/g, (_, code) => String.fromCharCode(parseInt(code, 16)));

export function layoutText(layout) {
  if (!layout) return "";
  if (!layout.parts) return `${layout.tab}${layout.argument ? `/${escaped(layout.argument)}` : ""}`;
  const parts = layout.parts.map((part, index) => `${layoutText(part)}*${Math.round(layout.sizes[index] * 10) / 10}`);
  return `${layout.direction}(${parts.join("~")})`;
}

// Returns the layout of a text, or null for an empty one. Throws an Error if the text is malformed or names unknown views.
export function parsedLayout(text, tabs) {
  let at = 0;
  const take = (expression) => {
    expression.lastIndex = at;
    const found = expression.exec(text);
    if (found) at = expression.lastIndex;
    return found;
  };
  const fail = (reason) => { throw new Error(`The layout ${reason}, at character ${at + 1} of ${text.slice(0, 200)}`); };

  function part(depth) {
    if (depth > DEEPEST) fail(`has more than ${DEEPEST} levels`);
    const split = take(/(row|column)\(/y);
    if (split) return parts(split[1], depth);
    const view = take(/([a-z0-9]+)(?:\/([^()~*]*))?/y);
    if (!view) return fail("lacks the name of a view");
    if (!tabs.includes(view[1])) fail(`names an unknown view, ${view[1]}`);
    return leaf(view[1], completed(view[1], unescaped(view[2] ?? "")));
  }

  function parts(direction, depth) {
    const [found, sizes] = [[], []];
    do {
      found.push(part(depth + 1));
      sizes.push(Number(take(/\*(\d+(?:\.\d+)?)/y)?.[1] ?? 0));
    } while (take(/~/y));
    if (!take(/\)/y)) fail("lacks a closing bracket");
    const known = sizes.filter(Boolean);
    const rest = known.length ? known.reduce((sum, size) => sum + size, 0) / known.length : 1;
    return { direction, parts: found, sizes: sizes.map((size) => size || rest) };
  }

  if (!text) return null;
  const layout = part(0);
  if (at < text.length) fail("has more text than expected");
  if (leavesOf(layout).length > MAX_PANELS) fail(`has more than ${MAX_PANELS} panels`);
  return tidy(layout);
}

// Replaces splits with one part by that part, merges nested splits of the same direction, and makes sizes add up to 100.
function tidy(layout) {
  if (!layout?.parts) return layout;
  const [parts, sizes] = [[], []];
  const total = layout.sizes.reduce((sum, size) => sum + size, 0);
  layout.parts.forEach((each, index) => {
    const part = tidy(each);
    const size = (layout.sizes[index] / total) * 100;
    if (!part) return;
    const isSame = part.direction === layout.direction;
    parts.push(...(isSame ? part.parts : [part]));
    sizes.push(...(isSame ? part.sizes.map((share) => (share * size) / 100) : [size]));
  });
  if (parts.length < 2) return parts[0] ?? null;
  const sum = sizes.reduce((all, size) => all + size, 0);
  return { direction: layout.direction, parts, sizes: sizes.map((size) => (size / sum) * 100) };
}

// Replaces each leaf with what `change` returns: another layout, or null to leave it out.
function changed(layout, change) {
  if (!layout) return null;
  if (!layout.parts) return change(layout);
  return { ...layout, parts: layout.parts.map((part) => changed(part, change)) };
}

export const withLeaf = (layout, added) => changed(layout, (each) => (each.id === added.id ? added : each));
export const without = (layout, id) => tidy(changed(layout, (each) => (each.id === id ? null : each)));

// Puts a leaf on a side ("left", "right", "above", "below") of the leaf `id`, which gives up half of its space.
export function beside(layout, id, side, added) {
  const direction = side === "left" || side === "right" ? "row" : "column";
  const isFirst = side === "left" || side === "above";
  return tidy(changed(layout, (each) => (each.id === id
    ? { direction, parts: isFirst ? [added, each] : [each, added], sizes: [50, 50] } : each)));
}

// Adds a layout to the right of the largest leaf, or below it if it is taller than wide. `shape` is the whole width / height.
export function appended(layout, added, shape) {
  if (!layout) return added;
  const area = ({ box }) => box.w * box.h;
  const { leaf: largest, box } = placesOf(layout).panels.reduce((most, each) => (area(each) > area(most) + 1 ? each : most));
  return beside(layout, largest.id, box.w * shape > box.h ? "right" : "below", added);
}

// Moves the leaf `id` to a side of the leaf `target`, or with "centre" exchanges the two.
export function moved(layout, id, target, side) {
  const own = leavesOf(layout).find((each) => each.id === id);
  const other = leavesOf(layout).find((each) => each.id === target);
  if (!own || !other || own === other) return layout;
  if (side === "centre") return changed(layout, (each) => (each === own ? other : each === other ? own : each));
  return beside(without(layout, id), target, side, own);
}

// Moves the border after the part `index` of the split at `path` by some percent of the split.
export function resized(layout, path, index, percent) {
  if (path.length) {
    const [first, ...rest] = path;
    return { ...layout, parts: layout.parts.map((part, at) => (at === first ? resized(part, rest, index, percent) : part)) };
  }
  const sizes = [...layout.sizes];
  const both = sizes[index] + sizes[index + 1];
  const least = Math.min(SMALLEST, both / 2);
  sizes[index] = Math.min(both - least, Math.max(least, sizes[index] + percent));
  sizes[index + 1] = both - sizes[index];
  return { ...layout, sizes };
}

// Where panels and borders are, in percent of the whole: {panels: [{leaf, box}], borders: [{path, index, direction, box, share,
// size}]}. The box of a border has no width or height; `share` is the length of its split in percent of the whole, and `size` that
// of the part before it in percent of the split.
export function placesOf(layout, box = { x: 0, y: 0, w: 100, h: 100 }, path = []) {
  if (!layout) return { panels: [], borders: [] };
  if (!layout.parts) return { panels: [{ leaf: layout, box }], borders: [] };
  const isRow = layout.direction === "row";
  const places = { panels: [], borders: [] };
  let start = isRow ? box.x : box.y;
  layout.parts.forEach((part, index) => {
    const length = ((isRow ? box.w : box.h) * layout.sizes[index]) / 100;
    const own = isRow ? { ...box, x: start, w: length } : { ...box, y: start, h: length };
    const inner = placesOf(part, own, [...path, index]);
    places.panels.push(...inner.panels);
    places.borders.push(...inner.borders);
    start += length;
    if (index === layout.parts.length - 1) return;
    const line = isRow ? { ...box, x: start, w: 0 } : { ...box, y: start, h: 0 };
    places.borders.push({ path, index, direction: layout.direction, box: line, share: isRow ? box.w : box.h, size: layout.sizes[index] });
  });
  return places;
}
