// The drawing of the running system in a graph canvas: the server sends its layout, and then the traffic on its arrows.

import { bandwidth, h, hertz, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { live } from "../live.js";
import { silence } from "../silence.js";
import { LATCHED } from "../stale.js";

const NOTHING = "Nothing to show: no node is connected to another one, or everything is hidden.";

const narrow = matchMedia("(max-width: 900px)"); // there, arrows lead downwards
const THIN = 1.2; // width of lines (px); tenfold rates are THICKER more
const THICKER = 0.9;

// The width of a line for a rate in hertz.
const widthOf = (rate) => THIN + THICKER * Math.log10(1 + Math.max(0, rate));

// A rate in two digits, for arrows that lead downwards beside each other.
const shortRate = (rate) => (rate ? `${Number(rate.toPrecision(2))} Hz` : hertz(rate));

// `onDrawn(names)` is called after each new layout, with the names of all nodes and topics; `onError(text)` with an error or "";
// `onShowAll()` if the user wants to see what the options hide.
export function graphDrawing(canvas, context, onDrawn, onError, onShowAll) {
  const counts = h("span", { class: "pale" });
  const empty = emptyState("⬡");
  const hidden = h("button", { class: "plain link", title: "Show everything that the options hide", onclick: onShowAll });
  let isVertical = false;
  let traffic = [];
  let close = () => {};
  let watched = null; // options

  // Draws the graph with these options from now on.
  function watch(options) {
    watched = options;
    close();
    close = context.watch("graph", { ...options, vertical: narrow.matches }, (data) => {
      if (data.scene) draw(data);
      else update(data);
    }, onError);
  }

  function draw({ scene, too_many: tooMany, most, names, hidden: count }) {
    isVertical = scene.vertical;
    canvas.draw(scene);
    onDrawn(names);
    label();
    replace(hidden, count ? `${count} hidden: show` : "");
    empty.hidden = scene.boxes.length > 0;
    replace(empty, tooMany ? `${tooMany} nodes and topics match, and at most ${most} are drawn, fewer if their names are long. ` +
      `Narrow the filters Nodes and Topics, or show nodes only.` : NOTHING);
  }

  function update(data) {
    traffic = data.traffic;
    label();
    onError(data.error ? `The master does not answer: ${data.error}` : "");
    canvas.showAges(data.removed);
    replace(counts, `${data.nodes} nodes, ${data.topics} topics `, hidden.textContent ? hidden : null);
  }

  // The rate is shown only on the arrow from the publisher, because the arrow from the topic has the same rate.
  function label() {
    canvas.label((arrow, index) => {
      const values = arrow.start.kind === "topic" || arrow.wrong ? null : traffic[index];
      const measured = !values ? "" : isStale(values) ? "stale" : values[3] ? LATCHED
        : isVertical ? shortRate(values[0]) : `${hertz(values[0])} · ${bandwidth(values[1])}`;
      return [arrow.wrong && isVertical ? "wrong type" : arrow.text, measured].filter(Boolean).join("  ");
    }, (_arrow, index) => {
      const values = traffic[index];
      return { isStale: Boolean(values && isStale(values)), width: values ? widthOf(values[0]) : THIN };
    });
  }

  const isStale = (values) => Boolean(values[2] || silence.seconds);
  live.addEventListener("silence", label, { signal: context.signal });
  narrow.addEventListener("change", () => { if (watched) watch(watched); }, { signal: context.signal });

  return { counts, empty, watch };
}
