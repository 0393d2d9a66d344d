// Links and members of a fleet, as its agents report them on /diagnostics.

import { h, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { ageText, isStaleLevel, levelDot, levelNow, staleMark } from "../stale.js";
import { dataTable } from "../table.js";
import { toolbar } from "../toolbar.js";

const PREFIX = "/Fleet/"; // then the reporting and sending member; an aggregator puts its groups before it
const COLUMNS = [
  { title: "Member", text: ({ member }) => member, order: ({ key }) => key },
  { title: "Receives from", text: ({ from }) => from || "–", order: ({ from }) => from },
  { title: "State", kind: "long", text: stateText, order: ({ level }) => -level },
  { title: "Topics", kind: "number", text: ({ values }) => values["topics received"] ?? "–",
    order: ({ values }) => descending(values["topics received"]) },
  { title: "Messages/s", kind: "number", text: ({ rate }) => rate?.toFixed(1) ?? "–", order: ({ rate }) => descending(rate) },
  { title: "Messages", kind: "number", text: ({ messages }) => messages ?? "–", order: ({ messages }) => descending(messages) },
  ...["dropped", "unsent", "lost", "malformed"].map((name) => (
    { title: `${name[0].toUpperCase()}${name.slice(1)}`, kind: "number", text: ({ values }) => values[name] ?? "–",
      order: ({ values }) => descending(values[name]) })),
];

// The largest value first.
const descending = (value) => -(value ?? -1);

function stateText({ level, message, age }) {
  return h("span", {}, levelDot(level), isStaleLevel(level) ? [" ", staleMark(age), `: no report for ${ageText(age)}`] : ` ${message}`);
}

export function open(view, _argument, context) {
  const error = h("div", { class: "error", role: "alert" });
  const hint = emptyState("⚑", "No fleet agent reports. An agent runs beside a master: pipros fleet join NAME.");
  const table = dataTable(COLUMNS, { label: "Fleet", keyOf: ({ key }) => key, sortBy: "Member" });
  view.append(h("div", { class: "column" }, toolbar({ title: "Fleet" }, h("span", { class: "spring" }), table.csvButton("fleet")), error,
    hint, h("div", { class: "scroll" }, table.element)));
  let known = new Map(); // by name

  function rowOf(key, component, before) {
    const [member, ...from] = key.split("/");
    const values = Object.fromEntries(component.values);
    const messages = values.messages ?? values.sent;
    let rate = before?.rate;
    if (before && component.last > before.last) rate = Math.max(0, (messages - before.messages) / (component.last - before.last));
    return { ...component, key, member, from: from.join("/"), values, messages, rate };
  }

  context.watch("diagnostics", {}, (data) => {
    if (data.fresh) known = new Map();
    for (const component of data.components) {
      const start = component.name.indexOf(PREFIX);
      if (start < 0 || !component.values.length) continue; // an aggregator's groups have no values
      const key = component.name.slice(start + PREFIX.length);
      known.set(key, rowOf(key, component, known.get(key)));
    }
    replace(error, data.error);
    hint.hidden = known.size > 0;
    table.show([...known.values()].map((row) => ({ ...row, ...levelNow(row, data) })));
  }, (problem) => replace(error, problem), { always: true });
}
