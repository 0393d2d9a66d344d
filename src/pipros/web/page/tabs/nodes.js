// Nodes, with the resource usage of those on this machine.

import { live } from "../live.js";
import { bytes, h, replace } from "../dom.js";
import { placeOf } from "../place.js";

const COLUMNS = [
  ["name", "Node", (row) => h("a", { href: placeOf("graph", `n${row.name}`) }, row.name), false],
  ["host", "Host", (row) => row.host || "–", false],
  ["pid", "PID", (row) => row.pid ?? "–", true],
  ["cpu", "Processor", (row) => (row.cpu === undefined ? "–" : `${row.cpu.toFixed(1)} %`), true],
  ["memory", "Memory", (row) => bytes(row.memory), true],
  ["threads", "Threads", (row) => row.threads ?? "–", true],
  ["connections", "Connections", (row) => row.connections, true],
  ["files", "Descriptors", (row) => row.files ?? "–", true],
  ["error", "State", (row) => (row.error ? h("span", { class: "error-text" }, `does not answer: ${row.error}`) : "answers"), false],
];

export function open(view) {
  const error = h("div", { class: "note", hidden: true });
  const body = h("tbody", {});
  let order = "cpu";
  let rows = [];
  view.append(h("div", { class: "column" }, error, h("div", { class: "scroll" }, h("table", {}, h("thead", {}, h("tr", {}, COLUMNS.map(([key, title, , isNumber]) => h("th", { class: isNumber ? "number" : "", "data-key": key }, h("button", { class: "plain", onclick: () => { order = key; draw(); } }, title))))), body))));

  function draw() {
    const sorted = [...rows].sort((one, other) => {
      const [a, b] = [one[order] ?? -1, other[order] ?? -1];
      return typeof a === "number" && typeof b === "number" ? b - a : String(a).localeCompare(String(b));
    });
    for (const head of body.parentElement.querySelectorAll("th")) head.setAttribute("aria-sort", head.dataset.key === order ? (typeof sorted[0]?.[order] === "number" ? "descending" : "ascending") : "none");
    replace(body, sorted.map((row) => h("tr", {}, COLUMNS.map(([key, , text, isNumber]) => h("td", { class: isNumber ? "number" : key === "error" ? "long" : "" }, text(row))))));
  }

  return live.watch("processes", {}, (data) => {
    rows = data.nodes;
    error.hidden = !data.error;
    replace(error, data.error);
    draw();
  }, (problem) => { error.hidden = false; replace(error, problem); });
}
