// The graph of nodes and topics. / searches, Escape ends the selection; see graph/canvas.js for the other keys.

import { bandwidth, h, hertz, panelHead, replace } from "../dom.js";
import { graphCanvas } from "../graph/canvas.js";
import { eventPanel } from "../graph/events.js";
import { closeNamespaces, graphText, hideNothing, keptOptions, optionControls, parsedGraph, toggleNamespace } from "../graph/options.js";
import { nodePanel } from "../graph/node_panel.js";
import { savePicture } from "../graph/picture.js";
import { placeOf } from "../place.js";
import { topicPanel } from "../topic_panel.js";

const NOTHING = "Nothing to show: no node is connected to another one, or everything is hidden.";
const EVENTS = "events:";
const FORMATS = ["svg", "png", "dot"];

export function open(view, argument, context) {
  const [first, given] = parsedGraph(argument);
  const options = given ?? keptOptions();
  const canvas = graphCanvas("Graph of nodes and topics", (key) => onChosen(key));
  const error = h("div", { class: "error", role: "alert" });
  const counts = h("span", { class: "pale" });
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Selection" });
  const hits = h("span", { class: "pale", role: "status" });
  const search = h("input", { type: "search", placeholder: "Search (/)", "aria-label": "Search nodes and topics", oninput: () => mark(),
    onkeydown: (event) => { if (event.key === "Enter") showHit(); } });
  const empty = h("div", { class: "note", hidden: true, role: "status" }, NOTHING);
  const controls = h("span", { class: "options" });
  const toolbar = h("div", { class: "bar" }, controls, search, hits);
  const closer = h("button", { hidden: true, onclick: () => { closeNamespaces(options); regroup(""); } }, "Close namespaces");
  const corner = h("div", { class: "corner" }, counts, closer,
    h("button", { onclick: () => choose(selected === EVENTS ? "" : EVENTS) }, "Events"),
    canvas.zoomButtons(),
    h("span", { class: "buttons", role: "group", "aria-label": "Save the picture" },
      FORMATS.map((format) => h("button", { title: `Save as ${format.toUpperCase()}`, onclick: () => save(format) },
        format.toUpperCase()))));
  view.append(h("div", { class: "column graph" }, toolbar, error, empty, h("div", { class: "stage" }, canvas.element, corner)), side);

  let names = []; // of all nodes and topics, including hidden ones
  let traffic = [];
  let selected = first; // the text of a key; empty for none
  let closePanel = () => {};
  let closeView = () => {};
  function look() {
    closeView();
    closeView = context.watch("graph", options, (data) => {
      if (data.scene) draw(data);
      else update(data);
    }, (text) => replace(error, text));
  }

  function draw({ scene, too_many: tooMany, most, names: all }) {
    names = all;
    closer.hidden = !options.group_opened;
    canvas.draw(scene);
    if (selected.startsWith("group:")) select(selected); // its members may have changed
    else canvas.emphasise(selected);
    label();
    mark();
    empty.hidden = scene.boxes.length > 0;
    replace(empty, tooMany ? `${tooMany} nodes and topics match, and at most ${most} are drawn. Narrow the filters Nodes and Topics, or ` +
      `show nodes only.` : NOTHING);
  }

  function update(data) {
    traffic = data.traffic;
    label();
    replace(error, data.error ? `The master does not answer: ${data.error}` : "");
    canvas.showAges(data.removed);
    replace(counts, `${data.nodes} nodes, ${data.topics} topics`);
  }

  // The rate is shown only on the arrow from the publisher, because the arrow from the topic has the same rate.
  function label() {
    canvas.label((arrow, index) => {
      const values = arrow.start.kind === "topic" ? null : traffic[index];
      const measured = values ? `${hertz(values[0])} · ${bandwidth(values[1])}` : "";
      return [arrow.text, measured].filter(Boolean).join("  ");
    });
  }

  function mark() {
    const found = canvas.find(search.value);
    const wanted = search.value.trim().toLowerCase();
    const hidden = wanted ? names.filter((name) => name.toLowerCase().includes(wanted)).length - found.length : 0;
    replace(hits, wanted ? `${found.length} found` : "", hidden > 0
      ? [", ", h("button", { class: "plain", title: "Show everything that the options hide",
        onclick: () => { hideNothing(options); showOptions(); } }, `${hidden} hidden: show`)] : null);
    return found;
  }

  // Goes to the first hit, and selects it if it is the only one.
  function showHit() {
    const found = mark();
    canvas.centre(found[0]);
    if (found.length === 1 && found[0] !== selected) choose(found[0]);
  }

  function showOptions() {
    replace(controls, optionControls(options, () => changed()));
    changed();
  }

  // Shows the graph with changed options.
  function changed() {
    context.remember(graphText(selected, options), { isReplacing: true });
    canvas.fit();
    look();
  }

  function onChosen(key) {
    if (key.startsWith("namespace:")) regroup(key.slice("namespace:".length));
    else choose(key === selected ? "" : key);
  }

  // Opens a namespace; with an empty name only draws the graph of the changed options.
  function regroup(name) {
    if (name) toggleNamespace(options, name);
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
      showOptions();
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
    if (!selected) return;
    const at = selected.indexOf(":");
    const [kind, name] = [selected.slice(0, at), selected.slice(at + 1)];
    const close = () => choose("");
    if (selected === EVENTS) closePanel = eventPanel(side, context, close);
    else if (kind === "group") showGroup(name, close);
    else closePanel = (kind === "topic" ? topicPanel : nodePanel)(side, name, context, close);
  }

  function showGroup(name, close) {
    const members = canvas.vertexOf(selected)?.members ?? [];
    side.append(panelHead(name, close), h("ul", { class: "tree" },
      members.map((member) => h("li", {}, h("a", { href: placeOf("topics", member) }, member)))));
  }

  document.addEventListener("keydown", (event) => {
    if (!context.hears(event) || isTyping(event.target)) return;
    if (event.key === "/") search.focus();
    else if (event.key === "Escape" && selected) choose("");
    else if (!canvas.onKey(event)) return;
    event.preventDefault();
  }, { signal: context.signal });

  async function save(format) {
    try {
      await savePicture(options, format);
    } catch (problem) {
      replace(error, problem.message);
    }
  }

  replace(controls, optionControls(options, () => changed()));
  look();
  select(first);
  return { go };
}

const isTyping = (target) => target instanceof Element && target.matches("input, select, textarea");
