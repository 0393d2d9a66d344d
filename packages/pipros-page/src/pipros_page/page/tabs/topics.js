// All topics, and the newest message of the selected one.

import { bandwidth, h, hertz, problemLine, replace } from "../dom.js";
import { emptyLink, emptyState } from "../empty_state.js";
import { namespaceRows } from "../namespace_rows.js";
import { nodeText } from "../node_text.js";
import { LATCHED, rateText, staleMark } from "../stale.js";
import { dataTable } from "../table.js";
import { toolbar } from "../toolbar.js";
import { topicPanel } from "../topic_panel.js";

const MAX_ROWS = 500;
const MAX_MEASURED = 50; // the maximum that the server allows
const UNMEASURED = "Publishers report the rates of their connections: without a subscriber there is none. Measure subscribes to the topic.";
const DEEPEST = 5; // deeper rows are not indented further
const nodes = (names) => (names ?? []).map(nodeText).join(", ");
const COLUMNS = [
  { title: "Topic", kind: "name", text: nameText, order: (topic) => topic.name },
  { title: "Type", kind: "name mono", text: (topic) => topic.type ?? "", order: (topic) => topic.type },
  { title: "Publishers", kind: "name", text: (topic) => nodes(topic.publishers), order: (topic) => topic.publishers.length },
  { title: "Subscribers", kind: "name", text: (topic) => nodes(topic.subscribers), order: (topic) => topic.subscribers.length },
  { title: "Rate", kind: "number", text: rateOf, order: (topic) => topic.measured?.rate ?? topic.rate },
  { title: "Bandwidth", kind: "number", text: (topic) => (topic.count ? "" : rateText(bandwidth((topic.measured ?? topic).bandwidth))),
    order: (topic) => (topic.measured ?? topic).bandwidth },
  { title: "Measure", kind: "number", text: measureButton },
];

function nameText(topic) {
  if (topic.depth === undefined) return topic.wrong ? h("span", {}, wrongMark(topic), topic.name) : topic.name;
  const text = topic.count ? `${topic.isOpen ? "▾" : "▸"} ${topic.name} (${topic.count})` : [wrongMark(topic), topic.name];
  return h("span", { class: `depth-${Math.min(topic.depth, DEEPEST)}`, "aria-expanded": topic.count ? String(topic.isOpen) : null }, text);
}

// A sign for a topic whose messages are lost because a subscriber wants another type.
const wrongMark = ({ wrong }) => (wrong
  ? h("span", { class: "wrong-type", role: "img", "aria-label": `Wrong type: ${wrong}`, title: wrong }, "⚠ ") : null);

function rateOf(topic) {
  if (topic.count) return "";
  const rate = topic.measured ? topic.measured.rate : topic.rate;
  const staleFor = topic.measured?.stale ?? topic.stale;
  if (staleFor) return staleMark(staleFor);
  if (!rate && topic.latched) return LATCHED;
  return h("span", { title: typeof rate === "number" ? null : UNMEASURED }, rateText(hertz(rate)));
}

function measureButton(topic) {
  if (topic.count) return "";
  return h("button", { class: "plain measure", "data-topic": topic.name,
    "aria-label": `Measure ${topic.name}`,
    title: topic.isChosen ? "Stop measuring" : "Measure", "aria-pressed": String(Boolean(topic.isChosen)) }, topic.isChosen ? "■" : "◷");
}

export function open(view, argument, context) {
  const filter = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter topics", oninput: () => draw() });
  const error = problemLine();
  const none = emptyState("≋");
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Topic" });
  const table = dataTable(COLUMNS, { label: "Topics", keyOf: (topic) => topic.name, onChoose, onSort: () => draw(), most: MAX_ROWS,
    sortBy: "Topic" });
  table.element.classList.add("fixed", "topics");
  table.element.addEventListener("click", (event) => {
    const button = event.target.closest("button.measure");
    if (!button) return;
    event.stopPropagation();
    measured.toggle(button.dataset.topic);
  }, { capture: true });
  table.element.addEventListener("keydown", (event) => {
    if (event.target.closest("button.measure")) event.stopPropagation(); // Enter presses the button, and does not select the row
  }, { capture: true });
  view.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && selected && !event.target.matches("input")) choose("");
  });
  const inTree = h("input", { type: "checkbox", onchange: () => draw() });
  const all = h("button", { title: `Subscribe to the first ${MAX_MEASURED} topics of the list`,
    onclick: () => measured.choose(measured.count() ? [] : shown().map((topic) => topic.name)) }, "Measure all");
  view.append(h("div", { class: "column" }, toolbar({ title: "Topics" }, filter, h("label", {}, inTree, "Tree"), all,
    h("span", { class: "spring" }), table.csvButton("topics")), error.element, none, h("div", { class: "scroll" }, table.element)), side);
  let topics = [];
  let selected = "";
  const measured = measurement(context, () => draw(), error.show);
  const closed = new Set(); // namespaces
  let closePanel = () => {};

  function shown() {
    const wanted = filter.value.trim().toLowerCase();
    return topics.filter((topic) => !wanted || `${topic.name} ${topic.type}`.toLowerCase().includes(wanted));
  }

  function draw() {
    const rows = shown().map((topic) => ({ ...topic, ...measured.of(topic.name) }));
    if (inTree.checked) table.show(namespaceRows(rows, (name) => closed.has(name)), { isOrdered: true });
    else table.show(rows);
    replace(all, measured.count() ? `Stop measuring ${measured.count()}` : "Measure all");
  }

  function onChoose(name) {
    if (!name.endsWith("/")) { choose(name === selected ? "" : name); return; }
    if (!closed.delete(name)) closed.add(name);
    draw();
  }

  function choose(name) {
    context.remember(name);
    go(name);
  }

  function go(name) {
    selected = name;
    table.mark(name);
    closePanel();
    closePanel = () => {};
    side.replaceChildren();
    side.hidden = !name;
    if (name) closePanel = topicPanel(side, name, context, () => choose(""));
  }

  context.watch("topics", {}, (data) => {
    topics = data.topics;
    none.hidden = topics.length > 0;
    if (!topics.length) replace(none, "There are no topics.", emptyLink("publish", "Publish one"));
    error.show(data.error ? `The master does not answer: ${data.error}` : "");
    draw();
  }, error.show);
  if (argument) go(argument);
  return { go };
}

// The topics whose rate and bandwidth the server measures, and the values that it measured.
function measurement(context, onChange, onError) {
  let chosen = new Set(); // names of topics
  let figures = {}; // name to the measured values
  let stop = () => {};

  function choose(names) {
    if (names.length > MAX_MEASURED) onError(`At most ${MAX_MEASURED} topics are measured at a time.`);
    chosen = new Set(names.slice(0, MAX_MEASURED));
    const stopLast = stop;
    stop = () => {};
    figures = Object.fromEntries(Object.entries(figures).filter(([name]) => chosen.has(name)));
    if (chosen.size) {
      stop = context.watch("measured", { names: [...chosen] }, (data) => {
        figures = data.topics;
        onChange();
      }, onError);
    }
    stopLast();
    onChange();
  }

  function toggle(name) {
    if (!chosen.has(name)) choose([...chosen, name]);
    else choose([...chosen].filter((each) => each !== name));
  }

  return { choose, toggle, count: () => chosen.size, of: (name) => ({ isChosen: chosen.has(name), measured: figures[name] }) };
}
