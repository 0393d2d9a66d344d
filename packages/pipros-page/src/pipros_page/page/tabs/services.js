// Services, and a form to call them.

import { runningNote } from "../bags/running_note.js";
import { copiesValues } from "../copy.js";
import { h, milliseconds, panelHead, problemLine, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { dataTable } from "../table.js";
import { tree } from "../message_values.js";
import { toolbar } from "../toolbar.js";

const MAX_ROWS = 500;
const LOGGER_SERVICES = /\/(get_loggers|set_logger_level)$/;
const COLUMNS = [
  { title: "Service", kind: "name", text: ([name]) => name, order: ([name]) => name },
  { title: "Node", kind: "name", text: ([, node]) => node, order: ([, node]) => node },
];

export function open(view, argument, context) {
  const filter = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter services", oninput: () => draw() });
  const hidesLoggers = h("input", { type: "checkbox", checked: true, onchange: () => draw() });
  const error = problemLine();
  const none = emptyState("⇄");
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Service",
    onkeydown: (event) => { if (event.key === "Escape") choose(""); } });
  const table = dataTable(COLUMNS, { label: "Services", keyOf: ([name]) => name, onChoose: (name) => choose(name === selected ? "" : name),
    most: MAX_ROWS, sortBy: "Service" });
  table.element.classList.add("fixed");
  view.append(h("div", { class: "column" }, runningNote(context.signal),
    toolbar({ title: "Services" }, filter, h("label", {}, hidesLoggers, "Hide logger services"),
    h("span", { class: "spring" }), table.csvButton("services")), error.element, none,
    h("div", { class: "scroll" }, table.element)), side);
  let services = [];
  let selected = "";
  const ask = context.newest();

  function draw() {
    const wanted = filter.value.trim().toLowerCase();
    const rows = services.filter(([name]) => name.toLowerCase().includes(wanted) && !(hidesLoggers.checked && LOGGER_SERVICES.test(name)));
    none.hidden = rows.length > 0;
    replace(none, services.length ? `None of the ${services.length} services is shown: they are hidden or filtered.`
      : "There are no services.");
    table.show(rows);
  }

  async function choose(name) {
    context.remember(name);
    await go(name);
    side.focus(); // its keys call a service without a field, too
    if (selected === name) side.querySelector("textarea")?.select();
  }

  async function go(name) {
    selected = name;
    table.mark(name);
    side.hidden = !name;
    if (!name) return;
    replace(side, panelHead(name, () => choose("")));
    try {
      const service = await ask("service", { name });
      side.append(...form(name, service).flat().filter(Boolean));
    } catch (problem) {
      side.append(h("p", { class: "error" }, problem.message));
    }
  }

  function form(name, service) {
    const request = h("textarea", { rows: 8, class: "mono", "aria-label": "Request in YAML", spellcheck: "false" });
    request.value = yaml(service.request);
    const answer = h("div", { class: "answer", "aria-live": "polite" });
    const call = h("button", { disabled: !context.control, title: "Control+Enter", "aria-keyshortcuts": "Control+Enter",
      onclick: () => send(name, request.value, answer) }, "Call");
    return [
      h("dl", {}, h("dt", {}, "Type"), h("dd", {}, service.type), h("dt", {}, "Arguments"), h("dd", {}, service.arguments || "none")),
      service.definition ? h("details", { class: "definition" }, h("summary", {}, "Definition"),
        h("pre", { class: "mono whole" }, service.definition)) : null,
      service.arguments ? [h("h3", {}, "Request"), request] : null,
      h("p", {}, call, context.control ? "" : " Start with --control to call services."), answer,
    ];
  }

  async function send(name, request, answer) {
    replace(answer, "…");
    try {
      const { response, seconds } = await ask("call_service", { name, request });
      replace(answer, h("h3", {}, `Response after ${milliseconds(seconds)}`), copiesValues(h("div", {}, tree(response)), error.show));
    } catch (problem) {
      replace(answer, h("p", { class: "error" }, problem.message));
    }
  }

  context.watch("services", {}, (data) => {
    services = data.services;
    draw();
  }, error.show);
  if (argument) go(argument);
  return { go };
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
