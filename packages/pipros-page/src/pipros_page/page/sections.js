// The tabs, some of which have several sections, each with an address.

import { h } from "./dom.js";
import { placeOf } from "./place.js";

// Names, titles and groups in the head.
export const TABS = [
  ["panels", "Overview", "See"],
  ["graph", "Graph", "See"],
  ["scene", "Scene", "See"],
  ["images", "Images", "See"],
  ["plot", "Plot", "See"],
  ["topics", "Topics", "Data"],
  ["console", "Console", "Data"],
  ["params", "Parameters", "Data"],
  ["nodes", "Nodes", "Robot"],
  ["tf", "TF", "Robot"],
  ["diagnostics", "Diagnostics", "Robot"],
  ["fleet", "Fleet", "Robot"],
  ["ros2", "ROS 2", "Robot"],
  ["bags", "Bags", "Bags"],
  ["services", "Services", "Act"],
  ["actions", "Actions", "Act"],
  ["publish", "Publish", "Act"],
  ["teleop", "Teleop", "Act"],
  ["acts", "Acts", "Act"],
];

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
