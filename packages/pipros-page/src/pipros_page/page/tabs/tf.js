// Tree of coordinate frames, as a drawing and a table.

import { h, hertz, milliseconds, problemLine, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { framePair } from "../frame_pair.js";
import { graphCanvas } from "../graph/canvas.js";
import { rateText, staleMark } from "../stale.js";
import { dataTable } from "../table.js";

const rateOf = (frame) => (frame.static ? "static" : frame.stale ? staleMark(frame.age) : rateText(hertz(frame.rate)));
const ageText = (frame) => (frame.static ? "" : frame.stale ? staleMark(null, `${frame.age.toFixed(1)} s`) : `${frame.age.toFixed(1)} s`);
const OTHER_CLOCK_S = 3600; // a longer delay is the difference of two clocks, such as a simulation's and this machine's
const delayText = ({ delay }) => (Math.abs(delay) > OTHER_CLOCK_S ? "other clock" : milliseconds(delay));
const COLUMNS = [
  { title: "Frame", text: (frame) => frame.frame, order: (frame) => frame.frame },
  { title: "Parent", text: (frame) => frame.parent, order: (frame) => frame.parent },
  { title: "From", text: (frame) => frame.authority, order: (frame) => frame.authority },
  { title: "Rate", kind: "number", text: rateOf, order: (frame) => frame.rate },
  { title: "Age", kind: "number", text: ageText, order: (frame) => frame.age },
  { title: "Delay", kind: "number", text: (frame) => (frame.static || frame.stale || frame.delay === null ? "" : delayText(frame)),
    order: (frame) => frame.delay },
];

const UNLISTED = "Frames whose transforms ended before this view was opened are not listed.";

export function open(view, argument, context) {
  let selected = argument;
  const canvas = graphCanvas("Tree of frames", (key) => choose(nameOf(key) === selected ? "" : nameOf(key)));
  const table = dataTable(COLUMNS, { label: "Frames", keyOf: (frame) => frame.frame,
    onChoose: (name) => choose(name === selected ? "" : name), sortBy: "Frame" });
  const error = problemLine();
  const hint = emptyState("⊹", "No transform received yet on /tf or /tf_static.");
  const counts = h("span", { class: "pale", title: UNLISTED });
  const pair = framePair(context, (chosen) => choose(chosen));
  view.append(h("div", { class: "column graph" }, pair.bar, error.element, hint, pair.element,
    h("div", { class: "stage" }, canvas.element, h("div", { class: "corner" }, counts, canvas.zoomButtons())),
    h("div", { class: "scroll half" }, table.element)));

  function choose(name) {
    context.remember(name);
    go(name);
  }

  function go(name) {
    selected = name;
    pair.go(name);
    canvas.emphasise(name ? `frame:${name}` : null);
    table.mark(name);
  }

  context.watch("frames", {}, (data) => {
    hint.hidden = data.frames.length > 0;
    error.show(data.error);
    if (data.scene) canvas.draw(data.scene);
    const old = data.frames.filter((frame) => frame.stale);
    canvas.markStale(old.map((frame) => `frame:${frame.frame}`));
    const frames = `${data.frames.length} frame${data.frames.length === 1 ? "" : "s"}`;
    replace(counts, `${frames} since this view was opened`, old.length ? `, ${old.length} stale` : "");
    table.show(data.frames);
    pair.offer(data.frames);
    canvas.emphasise(selected ? `frame:${selected}` : null);
    table.mark(selected);
  }, error.show);
  view.addEventListener("keydown", (event) => {
    if (event.target.matches("input")) return;
    if (event.key === "Escape" && selected) choose("");
    else if (!canvas.onKey(event)) return;
    event.preventDefault();
  });
  if (selected) go(selected);
  return { go };
}

const nameOf = (key) => key.slice("frame:".length);
