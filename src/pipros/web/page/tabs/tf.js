// Tree of coordinate frames, as a drawing and a table.

import { live } from "../live.js";
import { h, hertz, replace, s } from "../dom.js";

const LARGEST_SCALE = 1.3;

export function open(view) {
  const error = h("div", { class: "error", role: "alert" });
  const canvas = s("svg", { class: "canvas", role: "img", "aria-label": "Tree of frames" });
  const body = h("tbody", {});
  const hint = h("div", { class: "note" }, "No transform received yet on /tf or /tf_static.");
  view.append(h("div", { class: "column graph" }, error, hint, canvas, h("div", { class: "scroll half" }, h("table", {},
    h("thead", {}, h("tr", {}, ["Frame", "Parent", "From"].map((title) => h("th", {}, title)), ["Rate", "Age", "Delay"].map((title) => h("th", { class: "number" }, title)))), body))));
  return live.watch("frames", {}, (data) => {
    hint.hidden = data.frames.length > 0;
    replace(error, data.error);
    if (data.scene) draw(canvas, data.scene);
    replace(body, data.frames.map((frame) => h("tr", {}, h("td", {}, frame.frame), h("td", {}, frame.parent), h("td", {}, frame.authority),
      h("td", { class: "number" }, frame.static ? "static" : hertz(frame.rate)), h("td", { class: "number" }, frame.static ? "" : `${frame.age.toFixed(1)} s`), h("td", { class: "number" }, frame.static || frame.delay === null ? "" : `${(frame.delay * 1000).toFixed(0)} ms`))));
  }, (problem) => replace(error, problem));
}

function draw(canvas, scene) {
  const width = Math.max(scene.width, canvas.clientWidth / LARGEST_SCALE);
  const height = Math.max(scene.height, canvas.clientHeight / LARGEST_SCALE);
  canvas.setAttribute("viewBox", `${(scene.width - width) / 2} ${(scene.height - height) / 2} ${width} ${height}`);
  canvas.replaceChildren(
    s("defs", {}, s("marker", { id: "head", viewBox: "0 0 8 8", refX: 7.5, refY: 4, markerWidth: 8, markerHeight: 8, orient: "auto" }, s("path", { class: "head", d: "M0,0.5 L8,4 L0,7.5 Z" }))),
    ...scene.arrows.map((arrow) => s("path", { class: "arrow", d: arrow.path, "marker-end": "url(#head)" })),
    ...scene.boxes.map((box) => s("g", {}, s("rect", { class: "node", x: box.x - box.w / 2, y: box.y - box.h / 2, width: box.w, height: box.h, rx: 12 }), s("text", { x: box.x, y: box.y, "text-anchor": "middle", "dominant-baseline": "central" }, box.text))));
}
