// All topics, and the newest message of the selected one.

import { h, hertz, replace } from "../dom.js";
import { dataTable } from "../table.js";
import { topicPanel } from "../topic_panel.js";

const MOST_ROWS = 500;
const UNMEASURED = "Publishers report the rates of their connections: without a subscriber there is none";
const COLUMNS = [
  { title: "Topic", kind: "name", text: (topic) => topic.name, order: (topic) => topic.name },
  { title: "Type", kind: "name mono", text: (topic) => topic.type, order: (topic) => topic.type },
  { title: "Publishers", kind: "name", text: (topic) => topic.publishers.join(", "), order: (topic) => topic.publishers.length },
  { title: "Subscribers", kind: "name", text: (topic) => topic.subscribers.join(", "), order: (topic) => topic.subscribers.length },
  { title: "Rate", kind: "number", text: rateText, order: (topic) => topic.rate },
];

function rateText(topic) {
  return h("span", { title: typeof topic.rate === "number" ? null : UNMEASURED }, hertz(topic.rate));
}

export function open(view, argument, context) {
  const filter = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter topics", oninput: () => draw() });
  const error = h("div", { class: "error", role: "alert" });
  const none = h("div", { class: "note", hidden: true }, "There are no topics.");
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Topic", onkeydown: (event) => { if (event.key === "Escape") choose(""); } });
  const table = dataTable(COLUMNS, { label: "Topics", keyOf: (topic) => topic.name, onChoose: (name) => choose(name === selected ? "" : name), most: MOST_ROWS, sortBy: "Topic" });
  table.element.classList.add("fixed", "topics");
  view.append(h("div", { class: "column" }, h("div", { class: "bar" }, filter, h("span", { class: "spring" }), table.csvButton("topics")), error, none, h("div", { class: "scroll" }, table.element)), side);
  let topics = [];
  let selected = "";
  let closePanel = () => {};

  function draw() {
    const wanted = filter.value.trim().toLowerCase();
    table.show(topics.filter((topic) => !wanted || `${topic.name} ${topic.type}`.toLowerCase().includes(wanted)));
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
    replace(error, data.error ? `The master does not answer: ${data.error}` : "");
    draw();
  }, (text) => replace(error, text));
  if (argument) go(argument);
  return { go };
}
