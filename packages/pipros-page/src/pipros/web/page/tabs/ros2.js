// What the gateways to ROS 2 pass and leave out, as they report it on /diagnostics.

import { h, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { ageText, isStaleLevel, levelNow, staleMark } from "../stale.js";
import { dataTable } from "../table.js";
import { toolbar } from "../toolbar.js";

const PREFIX = "/ROS 2/"; // followed by the gateway's node; an aggregator puts its groups before it
const KINDS = { topics: "topic", services: "service", actions: "action" };
const RATE = /^([\d.]+)\/s, (\d+) dropped(?:: (.*))?$/s;
const COLUMNS = [
  { title: "Name", text: ({ name }) => name, order: ({ name }) => name },
  { title: "Kind", text: ({ kind }) => KINDS[kind] ?? kind, order: ({ kind }) => kind },
  { title: "Direction", text: ({ direction }) => (direction === "to_ros1" ? "to ROS 1" : "to ROS 2"), order: ({ direction }) => direction },
  { title: "Rate/s", kind: "number", text: ({ rate }) => rate?.toFixed(1) ?? "–", order: ({ rate }) => -(rate ?? -1) },
  { title: "Dropped", kind: "number", text: ({ dropped }) => dropped ?? "–", order: ({ dropped }) => -(dropped ?? -1) },
  { title: "Remark", kind: "long", text: ({ remark, isStale }) => (isStale ? staleMark(null, remark) : remark),
    order: ({ remark }) => remark },
  { title: "Gateway", text: ({ gateway }) => gateway, order: ({ gateway }) => gateway },
];

function rowOf(gateway, key, value, staleFor) {
  const [kind, direction, ...name] = key.split(": ");
  const [, rate, dropped, reason = ""] = RATE.exec(value) ?? [];
  const remark = staleFor === null ? rate === undefined ? value : reason : `stale: no report for ${ageText(staleFor)}`;
  return { key: `${gateway} ${key}`, gateway, kind, direction, name: name.join(": "), rate: rate && Number(rate),
    dropped: dropped && Number(dropped), remark, isStale: staleFor !== null };
}

export function open(view, _argument, context) {
  const error = h("div", { class: "error", role: "alert" });
  const hint = emptyState("②", "No ROS 2 gateway reports. A gateway runs beside a master: pipros ros2.");
  const table = dataTable(COLUMNS, { label: "ROS 2", keyOf: ({ key }) => key, sortBy: "Name" });
  view.append(h("div", { class: "column" }, toolbar({ title: "ROS 2" }, h("span", { class: "spring" }), table.csvButton("ros2")), error,
    hint, h("div", { class: "scroll" }, table.element)));
  let known = new Map(); // by the name of the gateway's node

  context.watch("diagnostics", {}, (data) => {
    if (data.fresh) known = new Map();
    for (const component of data.components) {
      const start = component.name.indexOf(PREFIX);
      if (start >= 0) known.set(component.name.slice(start + PREFIX.length), component);
    }
    replace(error, data.error);
    hint.hidden = known.size > 0;
    table.show([...known].flatMap(([gateway, component]) => {
      const { age, level } = levelNow(component, data);
      return component.values.map(([key, value]) => rowOf(gateway, key, value, isStaleLevel(level) ? age : null));
    }));
  }, (problem) => replace(error, problem), { always: true });
}
