// Nodes, with the resource usage of those on this machine.

import { bytes, h, problemLine } from "../dom.js";
import { nodeText } from "../node_text.js";
import { placeOf } from "../place.js";
import { sections } from "../sections.js";
import { dataTable, largestFirst } from "../table.js";
import { toolbar } from "../toolbar.js";

const COLUMNS = [
  { title: "Node", text: (row) => h("a", { href: placeOf("graph", `node:${row.name}`), title: row.name }, nodeText(row.name)),
    order: (row) => row.name },
  { title: "Host", text: (row) => row.host || "–", order: (row) => row.host },
  { title: "PID", kind: "number", text: (row) => row.pid ?? "–", order: (row) => row.pid },
  { title: "Processor", kind: "number", text: (row) => (row.cpu === undefined ? "–" : h("span", {},
    h("progress", { max: 100, value: row.cpu, "aria-hidden": "true" }), `${row.cpu.toFixed(1)} %`)),
    order: (row) => largestFirst(row.cpu) },
  { title: "Memory", kind: "number", text: (row) => bytes(row.memory), order: (row) => largestFirst(row.memory) },
  { title: "Threads", kind: "number", text: (row) => row.threads ?? "–", order: (row) => largestFirst(row.threads) },
  { title: "Connections", kind: "number", text: (row) => row.connections, order: (row) => largestFirst(row.connections) },
  { title: "Descriptors", kind: "number", text: (row) => row.files ?? "–", order: (row) => largestFirst(row.files) },
  { title: "State", kind: "long", text: stateText, order: (row) => row.error },
];

function stateText(row) {
  return h("span", { class: row.error ? "error-text" : null }, row.error ? `does not answer: ${row.error}` : "answers");
}

export function open(view, argument, context) {
  const error = problemLine();
  const table = dataTable(COLUMNS, { label: "Nodes", keyOf: (row) => row.name, sortBy: "Processor" });
  view.append(h("div", { class: "column" }, toolbar({ title: "Nodes" }, sections("nodes"), h("span", { class: "spring" }),
    table.csvButton("nodes")), error.element, h("div", { class: "scroll" }, table.element)));
  context.watch("processes", {}, (data) => {
    error.show(data.error);
    table.show(data.nodes);
  }, error.show);
}
