// The frame of the page: tabs, the address (#tab/argument), and the state of the connection.

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

const view = document.getElementById("view");
const tabs = document.getElementById("tabs");
const system = document.getElementById("system");
let close = () => {};
let about = null;
let tellKnown;
const known = new Promise((resolve) => { tellKnown = resolve; }); // what the server is and may do

// The token was for the first request only; it must not stay in the history.
if (location.search) history.replaceState(null, "", location.pathname + location.hash);

const place = () => {
  const [name, argument] = currentPlace();
  return TABS.some(([tab]) => tab === name) ? [name, argument] : ["graph", ""];
};

async function show() {
  const [name, argument] = place();
  close();
  close = () => {};
  for (const link of tabs.children) {
    link.setAttribute("aria-selected", String(link.dataset.tab === name));
  }
  document.title = `pipros: ${TABS.find(([tab]) => tab === name)[1]}`;
  const [module] = await Promise.all([import(`./tabs/${name}.js`), known]);
  if (place()[0] !== name || place()[1] !== argument) return;
  view.className = `tab-${name}`;
  view.replaceChildren();
  close = module.open(view, argument, { control: Boolean(about?.control) }) ?? (() => {});
}

function showState() {
  system.className = live.isOpen ? "" : "lost";
  if (!live.isOpen) replace(system, "no connection to the server, trying again");
  else replace(system, about ? `${about.master}${about.control ? " · can change the system" : " · only looks"}` : "");
}

for (const [name, title] of TABS) {
  tabs.append(h("a", { href: placeOf(name), role: "tab", "data-tab": name }, title));
}
tabs.addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  const links = [...tabs.children];
  const next = links[(links.indexOf(document.activeElement) + step + links.length) % links.length];
  next.focus();
  next.click();
});
live.addEventListener("state", async () => {
  showState();
  if (live.isOpen) {
    about = await live.act("about");
    tellKnown();
    showState();
  }
});
addEventListener("hashchange", show);
show();
