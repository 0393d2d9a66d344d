// The graph of nodes and topics. / searches, Escape ends the selection; see graph/canvas.js for the other keys.

import { h, problemLine, replace } from "../dom.js";
import { graphCanvas } from "../graph/canvas.js";
import { graphDrawing } from "../graph/drawing.js";
import { closeNamespaces, graphText, hideNothing, keptOptions, optionControls, parsedGraph, toggleNamespace } from "../graph/options.js";
import { savePicture } from "../graph/picture.js";
import { graphSearch } from "../graph/search.js";
import { EVENTS, selectionPanel } from "../graph/selection.js";
import { toolbar } from "../toolbar.js";

const FORMATS = ["svg", "png", "dot"];

export function open(view, argument, context) {
  const [first, given] = parsedGraph(argument);
  const options = given ?? keptOptions();
  const canvas = graphCanvas("Graph of nodes and topics", (key) => onChosen(key));
  const error = problemLine();
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Selection" });
  const search = graphSearch(canvas, (key) => { if (key !== selected) choose(key); }, () => showAll());
  const drawing = graphDrawing(canvas, context, onDrawn, error.show, () => showAll());
  const controls = h("span", { class: "options" });
  const closer = h("button", { hidden: true, onclick: () => { closeNamespaces(options); changed(); } }, "Close namespaces");
  const corner = h("div", { class: "corner" }, drawing.counts, closer,
    h("button", { onclick: () => choose(selected === EVENTS ? "" : EVENTS) }, "Events"),
    canvas.zoomButtons(), pictureButtons(options, error.show));
  view.append(h("div", { class: "column graph" }, toolbar({ title: "Graph" }, search.input, search.hits, controls), error.element,
    h("div", { class: "stage" }, canvas.element, drawing.empty, corner)), side);
  let selected = first; // the text of a key; empty for none
  let closePanel = () => {};

  function onDrawn(names) {
    closer.hidden = !options.group_opened;
    if (selected.startsWith("group:")) select(selected); // its members may have changed
    else canvas.emphasise(selected);
    search.setNames(names);
  }

  const drawControls = () => replace(controls, optionControls(options, () => changed()));

  function showAll() {
    hideNothing(options);
    drawControls();
    changed();
  }

  // Shows the graph with changed options.
  function changed() {
    context.remember(graphText(selected, options), { isReplacing: true });
    canvas.fit();
    drawing.watch(options);
  }

  function onChosen(key) {
    if (!key.startsWith("namespace:")) { choose(key === selected ? "" : key); return; }
    toggleNamespace(options, key.slice("namespace:".length));
    changed();
  }

  function choose(key) {
    context.remember(graphText(key, options));
    select(key);
  }

  function go(text) {
    const [key, wanted] = parsedGraph(text);
    if (wanted && graphText("", wanted) !== graphText("", options)) {
      Object.assign(options, wanted);
      selected = key;
      drawControls();
      changed();
    }
    select(key);
  }

  function select(key) {
    selected = key;
    canvas.emphasise(selected);
    closePanel();
    closePanel = () => {};
    side.hidden = !selected;
    side.replaceChildren();
    if (selected) closePanel = selectionPanel(side, selected, canvas.vertexOf(selected)?.members ?? [], context, () => choose(""));
  }

  document.addEventListener("keydown", (event) => {
    if (!context.hears(event) || isTyping(event.target)) return;
    if (event.key === "Escape" && selected) choose("");
    else if (!canvas.onKey(event)) return;
    event.preventDefault();
  }, { signal: context.signal });

  drawControls();
  drawing.watch(options);
  select(first);
  return { go };
}

function pictureButtons(options, onError) {
  const save = (format) => savePicture(options, format).catch((problem) => onError(problem.message));
  return h("span", { class: "buttons", role: "group", "aria-label": "Save the picture" },
    FORMATS.map((format) => h("button", { title: `Save as ${format.toUpperCase()}`, onclick: () => save(format) }, format.toUpperCase())));
}

const isTyping = (target) => target instanceof Element && target.matches("input, select, textarea");
