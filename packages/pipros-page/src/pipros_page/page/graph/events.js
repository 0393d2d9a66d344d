// Nodes and topics that were added or removed in the last ten minutes.

import { h, morph, panelHead, timeOfDay } from "../dom.js";
import { placeOf } from "../place.js";

// Fills `side`; returns a function that stops the updates.
export function eventPanel(side, context, onClose) {
  const body = h("div", {}, h("div", {}));
  side.append(panelHead("Events", onClose), h("p", { class: "key" }, "Nodes and topics added or removed in the last ten minutes"), body);
  return context.watch("events", {}, ({ events }) => morph(body.firstChild, h("div", {}, contents(events))));
}

const contents = (events) => (events.length ? h("ul", { class: "tree events" }, events.map(entry))
  : h("p", {}, "Nothing was added or removed."));

const entry = ({ when, added, kind, name }) => h("li", { "data-key": `${when} ${added} ${kind} ${name}` },
  h("span", { class: "key" }, `${timeOfDay(when)} `),
  h("span", { class: added ? "added" : "removed" }, `${added ? "+" : "−"} ${kind} `),
    h("a", { href: placeOf("graph", `${kind}:${name}`) }, name));
