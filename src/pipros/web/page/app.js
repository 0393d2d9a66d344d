// Frame of the page: tabs, address (#tab/argument) and connection state.

import { live } from "./live.js";
import { h, replace } from "./dom.js";
import { currentPlace, placeOf } from "./place.js";

const TABS = [
  ["graph", "Graph"],
  ["topics", "Topics"],
  ["plot", "Plot"],
  ["console", "Console"],
  ["params", "Parameters"],
  ["nodes", "Nodes"],
  ["images", "Images"],
  ["tf", "TF"],
  ["diagnostics", "Diagnostics"],
  ["services", "Services"],
  ["publish", "Publish"],
];

// The kind of change that the controls of a tab make.
const CHANGES = { console: "set_logger_level", params: "set_param", publish: "publishing", reconfigure: "set_reconfigured", services: "call_service" };
const PERMITS = { call_service: "can call services", publishing: "can publish", set_logger_level: "can set logger levels", set_reconfigured: "can reconfigure" };

// Sections of a tab with their own addresses.
const PARTS = { reconfigure: "params" };

const view = document.getElementById("view");
const tabs = document.getElementById("tabs");
const system = document.getElementById("system");
const locked = document.getElementById("locked");
let close = () => {};
let about = null;
let resolveKnown;
const known = new Promise((resolve) => { resolveKnown = resolve; }); // the server's description and permissions

const place = () => {
  const [name, argument] = currentPlace();
  return name in PARTS || TABS.some(([tab]) => tab === name) ? [name, argument] : ["graph", ""];
};

async function show() {
  const [name, argument] = place();
  close();
  close = () => {};
  const tab = PARTS[name] ?? name;
  for (const link of tabs.children) {
    const isSelected = link.dataset.tab === tab;
    link.setAttribute("aria-selected", String(isSelected));
    link.tabIndex = isSelected ? 0 : -1;
    if (isSelected) {
      view.setAttribute("aria-labelledby", link.id);
      link.scrollIntoView({ block: "nearest", inline: "nearest" });
    }
  }
  document.title = `pipros: ${TABS.find(([each]) => each === tab)[1]}`;
  const [module] = await Promise.all([import(`./tabs/${name}.js`), known]);
  if (place()[0] !== name || place()[1] !== argument) return;
  view.className = `tab-${name}`;
  view.replaceChildren();
  close = module.open(view, argument, { control: Boolean(about?.control || about?.may?.includes(CHANGES[name])) }) ?? (() => {});
}

function permit() {
  if (about.control) return "can change the system";
  return about.may.map((name) => PERMITS[name] ?? name).join(", ") || "read-only";
}

function showState() {
  system.className = live.isOpen ? "" : "lost";
  locked.hidden = !live.isRefused;
  view.hidden = live.isRefused;
  if (live.isRefused) replace(system, "no access");
  else if (!live.isOpen) replace(system, live.trouble || "no connection to the server", ", trying again");
  else if (about) replace(system, h("span", { class: "master", title: "The master" }, about.master.replace(/^http:\/\/|\/$/g, "")), h("span", { class: about.may.length ? "permit control" : "permit" }, permit()));
  else replace(system);
}

for (const [name, title] of TABS) {
  tabs.append(h("a", { href: placeOf(name), role: "tab", id: `tab-${name}`, "aria-controls": "view", "data-tab": name }, title));
}
tabs.addEventListener("keydown", (event) => {
  const links = [...tabs.children];
  const at = links.indexOf(document.activeElement);
  const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: links.length - 1 }[event.key];
  if (to === undefined) return;
  event.preventDefault();
  const next = links[(to + links.length) % links.length];
  next.focus();
  next.click();
});
live.addEventListener("state", async () => {
  showState();
  if (live.isOpen) {
    about = await live.act("about");
    resolveKnown();
    showState();
  }
});
addEventListener("hashchange", show);
showState();
show();
