// The panel beside the graph: the selected node or topic, the members of a group, or the events.

import { h, panelHead } from "../dom.js";
import { placeOf } from "../place.js";
import { topicPanel } from "../topic_panel.js";
import { eventPanel } from "./events.js";
import { nodePanel } from "./node_panel.js";

export const EVENTS = "events:";

// Fills `side` for the text of a key, such as node:/talker; returns a function that stops the updates. `members` are those of a group.
export function selectionPanel(side, selected, members, context, onClose) {
  const at = selected.indexOf(":");
  const [kind, name] = [selected.slice(0, at), selected.slice(at + 1)];
  if (selected === EVENTS) return eventPanel(side, context, onClose);
  if (kind !== "group") return (kind === "topic" ? topicPanel : nodePanel)(side, name, context, onClose);
  side.append(panelHead(name, onClose), h("ul", { class: "tree" },
    members.map((member) => h("li", {}, h("a", { href: placeOf("topics", member) }, member)))));
  return () => {};
}
