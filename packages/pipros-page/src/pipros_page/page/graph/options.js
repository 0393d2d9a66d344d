// The options of the graph, which the browser stores, and the toolbar that changes them.

import { h } from "../dom.js";
import { unfold } from "../toolbar.js";

const MODES = [["active", "Nodes/Topics (active)"], ["all", "Nodes/Topics (all)"], ["nodes", "Nodes only"]];
const HIDDEN = [
  ["hide_dead_sinks", "Dead sinks"],
  ["hide_leaf_topics", "Leaf topics"],
  ["hide_debug", "Debug"],
  ["hide_tf", "tf"],
  ["hide_unreachable", "Unreachable"],
  ["hide_parameters", "Params"],
];
const GROUPED = [["group_actions", "Actions"], ["group_images", "Images"], ["group_tf", "tf"]];
const KEEP = "pipros_tools.graph.options";
const INITIAL = {
  mode: "active", nodes: "/", topics: "/", hide_dead_sinks: true, hide_leaf_topics: true, hide_debug: true,
  hide_tf: false, hide_unreachable: false, hide_parameters: false,
  group_actions: true, group_images: true, group_tf: true, group_opened: "",
};
const PATTERN = "Names separated by commas; * stands for anything, a leading - excludes";

export function keptOptions() {
  try {
    const kept = JSON.parse(localStorage.getItem(KEEP) ?? "{}");
    const known = ([name, value]) => [name, typeof kept[name] === typeof value ? kept[name] : value];
    return Object.fromEntries(Object.entries(INITIAL).map(known));
  } catch {
    return { ...INITIAL };
  }
}

// The selection and the options that differ from the defaults, for addresses: node:/talker;mode=all;hide_debug=false.
export function graphText(selected, options) {
  const changed = Object.entries(INITIAL).filter(([name, usual]) => options[name] !== usual);
  return [selected, ...changed.map(([name]) => `${name}=${options[name]}`)].join(";");
}

// Returns [selection, options] of an address; the options are null if it has none.
export function parsedGraph(text) {
  const [selected, ...parts] = text.split(";");
  const options = { ...INITIAL };
  for (const part of parts) {
    const [name, value] = [part.slice(0, part.indexOf("=")), part.slice(part.indexOf("=") + 1)];
    if (name in INITIAL) options[name] = typeof INITIAL[name] === "boolean" ? value === "true" : value;
  }
  return [selected, parts.length ? options : null];
}

// Changes `options` so that they hide nothing.
export function hideNothing(options) {
  Object.assign(options, { mode: "all", nodes: "/", topics: "/" });
  for (const [name] of HIDDEN) options[name] = false;
  keep(options);
}

// Opens or closes a collapsed namespace in `options`, and stores them.
export function toggleNamespace(options, name) {
  const opened = options.group_opened.split(",").filter(Boolean);
  const rest = opened.filter((each) => each !== name && !each.startsWith(`${name}/`));
  options.group_opened = (opened.includes(name) ? rest : [...opened, name]).join(",");
  keep(options);
}

export function closeNamespaces(options) {
  options.group_opened = "";
  keep(options);
}

const keep = (options) => localStorage.setItem(KEEP, JSON.stringify(options));

// Returns controls that change `options`, store them, and call `onChange`.
export function optionControls(options, onChange) {
  const change = (name, value) => {
    options[name] = value;
    keep(options);
    onChange();
  };
  const pattern = (name, label) => h("label", {}, label, h("input", {
    value: options[name], size: 10, spellcheck: "false", title: PATTERN, onchange: (event) => change(name, event.target.value),
  }));
  const modes = MODES.map(([value, title]) => h("option", { value, selected: value === options.mode }, title));
  const boxes = (list) => list.map(([name, title]) => h("label", {},
    h("input", { type: "checkbox", checked: options[name], onchange: (event) => change(name, event.target.checked) }), title));
  // The filters are folded until this button shows them: see `.fold` in style.css.
  const folded = h("span", { class: "fold" }, pattern("nodes", "Nodes"), pattern("topics", "Topics"),
    h("span", { class: "choices", role: "group", "aria-label": "Hide" }, "Hide:", boxes(HIDDEN)),
    h("span", { class: "choices", role: "group", "aria-label": "Group" }, "Group:", boxes(GROUPED)));
  const folder = h("button", { "aria-expanded": "false", title: "What is hidden and grouped", onclick: () => {
    const isOpen = folded.classList.toggle("open");
    folder.setAttribute("aria-expanded", String(isOpen));
    unfold(folder.closest(".toolbar"), isOpen);
  } }, "Filters");
  return [
    h("select", { "aria-label": "What is shown", onchange: (event) => change("mode", event.target.value) }, modes),
    folder, folded,
  ];
}
