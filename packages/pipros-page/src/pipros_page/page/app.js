// Frame of the page: tabs, address (#tab/argument) and connection state.

import { live } from "./live.js";
import { h, replace } from "./dom.js";
import { askFirst } from "./bags/ask_first.js";
import { playback } from "./bags/playback.js";
import { rewindButton, timeBar } from "./bags/time_bar.js";
import { allViewsMenu, publishersMenu, tabGroups } from "./head_menus.js";
import { goHome, rememberPlace, robotLink } from "./home.js";
import { bell } from "./notices.js";
import { layoutText, leaf } from "./panels/layout.js";
import { currentPlace, placeOf } from "./place.js";
import { OTHER_SECTIONS, TABS, tabOf } from "./sections.js";
import { shortcuts } from "./shortcuts.js";
import { markRates } from "./stale.js";
import { TabContext } from "./tab_context.js";
import { viewModule } from "./views.js";

const NO_TOKEN = ["This page needs the token of its server", "Open the whole address that the command printed in its terminal: "];
const RESTARTED = ["The server was restarted", "Open the address that it printed in its terminal: "];

const view = document.getElementById("view");
const tabs = document.getElementById("tabs");
/** @type {HTMLAnchorElement[]} */
const links = [];
const toPanels = /** @type {HTMLAnchorElement} */ (document.getElementById("to-panels"));
const system = document.getElementById("system");
const locked = document.getElementById("locked");
const loading = h("p", { class: "note", role: "status" });
const opened = new Map(); // name to {element, context, handle, argument}; hidden tabs stay open
let about = null;
let masterError = ""; // the reason why the master does not answer; empty if it does
let resolveKnown;
const known = new Promise((resolve) => { resolveKnown = resolve; }); // the server's description and permissions

const place = () => {
  const [name, argument] = currentPlace();
  if (TABS.some(([tab]) => tab === tabOf(name))) return [name, argument];
  const titled = TABS.find(([, title]) => title.toLowerCase().replace(" ", "") === name.toLowerCase());
  return [titled?.[0] ?? "graph", ""];
};

async function show() {
  if (goHome(() => viewModule("scene").catch(() => {}))) return; // loads meanwhile; who opens it reports a failure
  const [name, argument] = place();
  if (location.hash && currentPlace()[0] !== name) history.replaceState(null, "", placeOf(name, argument)); // the address names no view
  const tab = tabOf(name);
  for (const link of links) {
    const isSelected = link.dataset.tab === tab;
    link.setAttribute("aria-selected", String(isSelected));
    link.tabIndex = isSelected ? 0 : -1;
    if (!isSelected) continue;
    link.href = placeOf(name, argument);
    view.setAttribute("aria-labelledby", link.id);
  }
  toPanels.hidden = name === "panels";
  foldTabs();
  rememberPlace();
  linkToPanels(name, argument);
  document.title = `pipros: ${TABS.find(([each]) => each === tab)[1]}`;
  const module = await moduleOf(name);
  if (!module || place()[0] !== name || place()[1] !== argument) return;
  loading.remove();
  const before = opened.get(name);
  const shown = before ?? open(name, argument, module); // open() has passed the argument on; the tab may have replaced it
  shown.context.show();
  if (!before || shown.argument === argument) return;
  shown.argument = argument;
  shown.handle.go?.(argument);
}

// Hides the other views. Returns a promise of the module of a view, in place of which a line says that it loads; null if it cannot.
async function moduleOf(name) {
  for (const [other, { element, context }] of opened) {
    element.hidden = other !== name;
    if (other !== name) context.hide();
  }
  replace(loading, "Loading …");
  if (!opened.has(name)) view.append(loading);
  try {
    return (await Promise.all([viewModule(name), known]))[0];
  } catch (problem) {
    if (place()[0] === name) replace(loading, `This view could not be loaded: ${problem.message}. `,
      h("button", { onclick: () => location.reload() }, "Try again"));
    return null;
  }
}

// Hides the tabs for which the running system has no data; the menu still offers them. All are shown while a
// bag is open.
let empty = [];
let updateHead = (_folded) => {};
function foldTabs() {
  const folded = playback.bag ? [] : empty;
  for (const link of links) link.hidden = folded.includes(link.dataset.tab) && link.getAttribute("aria-selected") !== "true";
  updateHead(folded);
}

// Makes the button in the head add what a tab shows to the panels.
function linkToPanels(name, argument) {
  toPanels.href = placeOf("panels", `+${layoutText(leaf(name, argument))}`);
}

// Whether a tab may change the system.
export const mayControl = (name) => Boolean(about?.control || about?.may?.includes(about.controls[name]));

function open(name, argument, module) {
  const element = h("div", { class: `tab tab-${name}` });
  const entry = { element, argument };
  entry.context = new TabContext(name, mayControl(name), (next) => {
    entry.argument = next;
    if (entry.context.isShown) linkToPanels(name, next);
    links.find((link) => link.dataset.tab === tabOf(name)).href = placeOf(name, next);
  });
  opened.set(name, entry);
  view.append(element);
  entry.handle = module.open(element, argument, entry.context) ?? {};
  return entry;
}

function masterState() {
  const address = about.master.replace(/^http:\/\/|\/$/g, "");
  if (!masterError) return h("span", { class: "master", title: "The master" }, address);
  return h("span", { class: "master lost", role: "alert", title: masterError }, `the master at ${address} does not answer`);
}

const permit = () => (about.control ? "can change the system"
  : about.may.map((name) => `can ${about.can[name]}`).join(", ") || "read-only");

// Asks for the token, or an address that contains it, and keeps the requested place.
function tokenForm() {
  const token = h("input", { size: 40, placeholder: "or the token alone", "aria-label": "Token or printed address", spellcheck: "false",
    autocomplete: "off" });
  return h("form", { class: "choices", onsubmit: (event) => {
    event.preventDefault();
    const found = token.value.trim().replace(/^.*#token=/, "").replace(/\/.*$/, "");
    if (found) location.hash = `token=${found}/${location.hash.slice(1)}`;
  } }, token, h("button", {}, "Open"));
}

function showState() {
  system.className = live.isCurrent ? "" : "lost";
  locked.hidden = !live.isRefused;
  view.hidden = live.isRefused;
  view.classList.toggle("outdated", about !== null && !live.isCurrent);
  markRates();
  const [title, text] = live.isRestarted ? RESTARTED : NO_TOKEN;
  if (!live.isRefused) replace(locked);
  else if (!locked.childElementCount || locked.firstChild.textContent !== title)
    replace(locked, h("h2", {}, title), h("p", {}, text, h("code", {}, "http://…/#token=…")), tokenForm(),
    h("p", { class: "pale" }, "Without --token-file, each start of the command creates a new token, so earlier addresses do not work. " +
      "A tab that you open yourself also needs the whole address; a reload does not."));
  if (!live.isCurrent) replace(system, live.problem(), live.isOpen || live.isRefused ? "" : ", trying again");
  else if (about) replace(system, masterState(), h("span", { class: about.may.length ? "permit control" : "permit" }, permit()));
  else replace(system);
}

for (const [name, title] of TABS) {
  links.push(h("a", { href: placeOf(name), role: "tab", id: `tab-${name}`, "aria-controls": "view", "data-tab": name,
    "data-title": title }, title));
}
robotLink(links[0]);
tabs.before(robotLink(h("a", { href: "#panels", id: "robot" }, "Overview"))); // on a phone, which shows the selected tab only
tabGroups(tabs, links, TABS);
updateHead = allViewsMenu(tabs, TABS.flatMap((tab) => [tab, ...OTHER_SECTIONS.filter(([name]) => tabOf(name) === tab[0])
  .map(([name, title]) => [name, title, tab[2]])]));
document.querySelector("header").prepend(shortcuts());
publishersMenu();
bell();
timeBar(document.getElementById("time"));
rewindButton(document.getElementById("rewind"));
askFirst(() => about?.can ?? {});
tabs.addEventListener("keydown", (event) => {
  const visible = links.filter((link) => !link.hidden);
  const at = visible.findIndex((link) => link === document.activeElement);
  const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: visible.length - 1 }[event.key];
  if (to === undefined) return;
  event.preventDefault();
  const next = visible[(to + visible.length) % visible.length];
  next.focus();
  next.click();
});
live.addEventListener("state", async () => {
  showState();
  if (live.isOpen) {
    about = await live.act("about");
    live.node = about.node;
    live.isSmooth = about.smooth;
    live.ofMessages = new Set(about.of_messages);
    resolveKnown();
    showState();
  }
});
live.addEventListener("silence", showState);
live.watch("master", {}, ({ error }) => {
  if (error === masterError) return;
  masterError = error;
  showState();
});
live.watch("content", {}, (data) => {
  ({ empty } = data);
  foldTabs();
});
playback.addEventListener("change", foldTabs);
addEventListener("hashchange", show);
showState();
show();
