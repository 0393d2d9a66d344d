// Services, and calls by hand.

import { live } from "../live.js";
import { h, limited, replace } from "../dom.js";
import { tree } from "../topic_panel.js";
import { placeOf } from "../place.js";

const MOST_ROWS = 500;

export function open(view, argument, { control }) {
  const filter = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter services", oninput: () => draw() });
  const error = h("div", { class: "error", role: "alert" });
  const body = h("tbody", {});
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Service" });
  view.append(h("div", { class: "column" }, h("div", { class: "bar" }, filter), error, h("div", { class: "scroll" }, h("table", { role: "grid", "aria-label": "Services" }, h("thead", {}, h("tr", {}, h("th", {}, "Service"), h("th", {}, "Node"))), body))), side);
  let services = [];
  let selected = "";

  function draw() {
    const wanted = filter.value.trim().toLowerCase();
    replace(body, limited(services.filter(([name]) => name.toLowerCase().includes(wanted)), MOST_ROWS, ([name, node]) => h("tr", { tabindex: 0, "data-name": name, "aria-selected": String(name === selected), onclick: () => select(name), onkeydown: (event) => { if (event.key === "Enter") select(name); } }, h("td", {}, name), h("td", {}, node)), 2));
  }

  async function select(name) {
    selected = name;
    history.replaceState(null, "", placeOf("services", name));
    draw();
    side.hidden = false;
    replace(side, h("h2", {}, name));
    try {
      const service = await live.act("service", { name });
      if (selected !== name) return;
      const request = h("textarea", { rows: 8, class: "mono", "aria-label": "Request in YAML", spellcheck: "false" });
      request.value = yaml(service.request);
      const answer = h("div", { class: "answer", "aria-live": "polite" });
      side.append(h("dl", {}, h("dt", {}, "Type"), h("dd", {}, service.type), h("dt", {}, "Arguments"), h("dd", {}, service.arguments || "none")), h("h3", {}, "Request"), request,
        h("p", {}, h("button", { disabled: !control, onclick: () => call(name, request.value, answer) }, "Call"), control ? "" : " Start with --control to call services."), answer);
    } catch (problem) {
      side.append(h("p", { class: "error" }, problem.message));
    }
  }

  async function call(name, request, answer) {
    replace(answer, "…");
    try {
      const { response, seconds } = await live.act("call_service", { name, request });
      replace(answer, h("h3", {}, `Response after ${(seconds * 1000).toFixed(1)} ms`), tree(response));
    } catch (problem) {
      replace(answer, h("p", { class: "error" }, problem.message));
    }
  }

  const close = live.watch("services", {}, (data) => {
    const isFirst = !services.length;
    services = data.services;
    draw();
    if (isFirst && argument && !selected) select(argument);
  }, (problem) => replace(error, problem));
  return close;
}

// Default values as YAML: JSON is YAML, and one field per line is easier to edit.
export function yaml(value) {
  if (value === null || typeof value !== "object" || Array.isArray(value)) return JSON.stringify(value);
  const lines = Object.entries(value).map(([key, item]) => {
    if (item !== null && typeof item === "object" && !Array.isArray(item) && !("…" in item)) {
      return Object.keys(item).length ? `${key}:\n${yaml(item).replace(/^/gm, "  ")}` : `${key}: {}`;
    }
    return `${key}: ${item !== null && typeof item === "object" && "…" in item ? "[]" : JSON.stringify(item)}`;
  });
  return lines.join("\n");
}
