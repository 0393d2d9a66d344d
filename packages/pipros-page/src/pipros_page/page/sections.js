// Tabs with several sections, each of which has an address.

import { h } from "./dom.js";
import { placeOf } from "./place.js";

const SECTIONS = {
  params: { label: "Parameters", parts: [["params", "All"], ["reconfigure", "Reconfigure"]] },
  nodes: { label: "Nodes", parts: [["nodes", "Processes"], ["launches", "Launches"]] },
};

// Returns the tab of a section, such as "params" for "reconfigure".
export const tabOf = (name) => Object.keys(SECTIONS).find((tab) => SECTIONS[tab].parts.some(([part]) => part === name)) ?? name;

// The sections whose names differ from their tabs': [name, title].
export const OTHER_SECTIONS = Object.entries(SECTIONS).flatMap(([tab, { parts }]) => parts.filter(([name]) => name !== tab));

export function sections(open) {
  const { label, parts } = SECTIONS[tabOf(open)];
  return h("nav", { class: "sections", "aria-label": label },
    parts.map(([name, title]) => h("a", { href: placeOf(name), "aria-current": name === open ? "page" : null }, title)));
}
