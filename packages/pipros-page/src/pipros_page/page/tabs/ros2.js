// What the gateways to ROS 2 pass and leave out, as they report it on /diagnostics.

import { reportTable } from "../report_table.js";
import { ageText, isStaleLevel, levelNow, staleMark } from "../stale.js";
import { largestFirst } from "../table.js";

const PREFIX = "/ROS 2/"; // followed by the gateway's node
const KINDS = { topics: "topic", services: "service", actions: "action" };
const RATE = /^([\d.]+)\/s, (\d+) dropped(?:: (.*))?$/s;
const COLUMNS = [
  { title: "Name", text: ({ name }) => name, order: ({ name }) => name },
  { title: "Kind", text: ({ kind }) => KINDS[kind] ?? kind, order: ({ kind }) => kind },
  { title: "Direction", text: ({ direction }) => (direction === "to_ros1" ? "to ROS 1" : "to ROS 2"), order: ({ direction }) => direction },
  { title: "Rate/s", kind: "number", text: ({ rate }) => rate?.toFixed(1) ?? "–", order: ({ rate }) => largestFirst(rate) },
  { title: "Dropped", kind: "number", text: ({ dropped }) => dropped ?? "–", order: ({ dropped }) => largestFirst(dropped) },
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
  reportTable(view, context, { title: "ROS 2", file: "ros2", prefix: PREFIX, columns: COLUMNS, sortBy: "Name", sign: "②",
    nothing: "No ROS 2 gateway reports. A gateway runs beside a master: pipros ros2." }, (_, component) => component,
  (gateway, component, data) => {
    const { age, level } = levelNow(component, data);
    return component.values.map(([key, value]) => rowOf(gateway, key, value, isStaleLevel(level) ? age : null));
  });
}
