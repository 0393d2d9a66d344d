// All topics, and the newest message of the selected one.

import { live } from "../live.js";
import { h, hertz, limited, replace } from "../dom.js";
import { topicPanel } from "../topic_panel.js";
import { placeOf } from "../place.js";

const MOST_ROWS = 500;

export function open(view, argument) {
  const filter = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter topics", oninput: () => draw() });
  const error = h("div", { class: "error", role: "alert" });
  const body = h("tbody", {});
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Topic" });
  view.append(
    h("div", { class: "column" }, h("div", { class: "bar" }, filter), error, h("div", { class: "scroll" },
      h("table", { role: "grid", "aria-label": "Topics" }, h("thead", {}, h("tr", {}, ["Topic", "Type", "Publishers", "Subscribers"].map((title) => h("th", {}, title)), h("th", { class: "number" }, "Rate"))), body))),
    side);
  let topics = [];
  let selected = "";
  let closePanel = () => {};

  function draw() {
    const wanted = filter.value.trim().toLowerCase();
    const shown = topics.filter((topic) => !wanted || `${topic.name} ${topic.type}`.toLowerCase().includes(wanted));
    const focused = document.activeElement?.dataset?.name;
    replace(body, limited(shown, MOST_ROWS, (topic) => h("tr", {
      tabindex: 0, "data-name": topic.name, "aria-selected": String(topic.name === selected),
      onclick: () => select(topic.name), onkeydown: (event) => { if (event.key === "Enter") select(topic.name); },
    }, h("td", {}, topic.name), h("td", { class: "mono" }, topic.type), h("td", { class: "long" }, topic.publishers.join(", ")),
    h("td", { class: "long" }, topic.subscribers.join(", ")), h("td", { class: "number" }, hertz(topic.rate))), 5));
    if (focused) body.querySelector(`[data-name="${CSS.escape(focused)}"]`)?.focus();
    if (!topics.length) replace(body, h("tr", {}, h("td", { colspan: 5, class: "note" }, "There are no topics.")));
  }

  function select(name) {
    selected = name === selected ? "" : name;
    history.replaceState(null, "", placeOf("topics", selected));
    closePanel();
    closePanel = () => {};
    side.replaceChildren();
    side.hidden = !selected;
    if (selected) closePanel = topicPanel(side, selected);
    draw();
  }

  const closeView = live.watch("topics", {}, (data) => {
    topics = data.topics;
    replace(error, data.error ? `The master does not answer: ${data.error}` : "");
    draw();
  }, (text) => replace(error, text));
  if (argument) select(argument);
  return () => {
    closeView();
    closePanel();
  };
}
