// Links and members of a fleet, as its agents report them on /diagnostics.

import { h } from "../dom.js";
import { reportTable } from "../report_table.js";
import { ageText, isStaleLevel, levelDot, levelNow, staleMark } from "../stale.js";
import { largestFirst } from "../table.js";

const PREFIX = "/Fleet/"; // then the reporting and sending member
const COLUMNS = [
  { title: "Member", text: ({ member }) => member, order: ({ key }) => key },
  { title: "Receives from", text: ({ from }) => from || "–", order: ({ from }) => from },
  { title: "State", kind: "long", text: stateText, order: ({ level }) => -level },
  { title: "Topics", kind: "number", text: ({ values }) => values["topics received"] ?? "–",
    order: ({ values }) => largestFirst(values["topics received"]) },
  { title: "Messages/s", kind: "number", text: ({ rate }) => rate?.toFixed(1) ?? "–", order: ({ rate }) => largestFirst(rate) },
  { title: "Messages", kind: "number", text: ({ messages }) => messages ?? "–", order: ({ messages }) => largestFirst(messages) },
  ...["dropped", "unsent", "lost", "malformed"].map((name) => (
    { title: `${name[0].toUpperCase()}${name.slice(1)}`, kind: "number", text: ({ values }) => values[name] ?? "–",
      order: ({ values }) => largestFirst(values[name]) })),
];

function stateText({ level, message, age }) {
  return h("span", {}, levelDot(level), isStaleLevel(level) ? [" ", staleMark(age), `: no report for ${ageText(age)}`] : ` ${message}`);
}

export function open(view, _argument, context) {
  reportTable(view, context, { title: "Fleet", file: "fleet", prefix: PREFIX, columns: COLUMNS, sortBy: "Member", sign: "⚑",
    nothing: "No fleet agent reports. An agent runs beside a master: pipros fleet join NAME." },
  (key, component, before) => (component.values.length ? rowOf(key, component, before) : null), // an aggregator's groups have no values
  (_, row, data) => ({ ...row, ...levelNow(row, data) }));
}

function rowOf(key, component, before) {
  const [member, ...from] = key.split("/");
  const values = Object.fromEntries(component.values);
  const messages = values.messages ?? values.sent;
  let rate = before?.rate;
  if (before && component.last > before.last) rate = Math.max(0, (messages - before.messages) / (component.last - before.last));
  return { ...component, key, member, from: from.join("/"), values, messages, rate };
}
