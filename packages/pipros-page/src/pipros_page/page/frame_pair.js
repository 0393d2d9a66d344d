// The newest transform between two frames, and the links that connect them.

import { h, morph, replace, uniqueId } from "./dom.js";
import { staleMark } from "./stale.js";
import { toolbar } from "./toolbar.js";

const BETWEEN = ">"; // in addresses: target>source

// Returns controls, an element and functions; `onChoose` is called with the text of a pair that the user chose.
export function framePair(context, onChoose) {
  const names = h("datalist", { id: uniqueId("frame-names") });
  const input = (label) => h("input", { list: names.id, size: 16, spellcheck: "false", "aria-label": label, placeholder: label,
    onchange: () => chosen() });
  const [target, source] = [input("In frame"), input("Pose of frame")];
  const bar = toolbar({ title: "Frames" }, h("span", {}, "Pose of"), source, h("span", {}, "in"), target, names);
  const body = h("div", {});
  const element = h("div", { class: "pair", hidden: true, role: "region", "aria-label": "Transform" }, body);
  let close = () => {};
  let shown = "";

  function chosen() {
    if (target.value && source.value) onChoose(`${target.value}${BETWEEN}${source.value}`);
  }

  // Shows the pair of an address, or nothing.
  function go(text) {
    if (text === shown) return;
    shown = text;
    close();
    close = () => {};
    element.hidden = !text.includes(BETWEEN);
    if (element.hidden) return;
    [target.value, source.value] = text.split(BETWEEN);
    close = context.watch("transform", { target: target.value, source: source.value },
      (data) => morph(body, h("div", {}, contents(data))), (problem) => replace(body, problem));
  }

  function offer(frames) {
    const all = [...new Set(frames.flatMap((frame) => [frame.frame, frame.parent]))].sort();
    if (all.join() !== [...names.children].map((option) => option.value).join()) replace(names, all.map((value) => h("option", { value })));
  }

  return { bar, element, go, offer };
}

function contents(data) {
  const rows = data.error ? [h("p", { class: "error" }, data.error)] : [h("dl", {},
    field("Translation (m)", data.translation), field("Rotation (x, y, z, w)", data.rotation),
    field("Roll, pitch, yaw (°)", data.angles), field("Time (s)", data.stamp === 0 ? ["static"] : [data.stamp.toFixed(3)]))];
  return [...rows, h("p", { class: "key" }, chain(data.source)), h("p", { class: "key" }, chain(data.target))];
}

const field = (title, values) => [h("dt", {}, title), h("dd", { class: "mono" }, values.join("  "))];

// The links of a frame up to its root, with the senders, so that a broken chain names the node that ended.
const chain = (links) => links.map((link, index) => [`${index ? "" : `${link.frame}`} ← ${link.parent} (${link.from || "unknown"}, ` +
  `${link.age === null ? "static" : `${link.age} s ago`}`, link.stale ? [", ", staleMark(link.age)] : null, ")"]);
