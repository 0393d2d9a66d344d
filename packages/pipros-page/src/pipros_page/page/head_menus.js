// Menus in the head of the page: all views (if some tabs do not fit or are hidden), and the running publishers.

import { h, replace } from "./dom.js";
import { placeOf } from "./place.js";
import { onPublishers, publisherList } from "./publishers.js";

const phone = matchMedia("(max-width: 700px)"); // there, only the selected tab is shown, and the menu offers the others
const groupsOf = (titles) => [...new Set(titles.map(([, , group]) => group))];

// Puts the tabs into their groups. A group without room for its tabs is one word, and shows them while the pointer or the focus is on
// it, or after a tap.
export function tabGroups(tabs, links, titles) {
  const toggle = ({ currentTarget, target }) =>
    currentTarget.classList.toggle("open", target.matches(".name") && !currentTarget.matches(".open"));
  tabs.append(...groupsOf(titles).map((group) => h("span", { class: "group", onclick: toggle }, h("span", { class: "name" }, group),
    h("span", { class: "views" }, links.filter((_, index) => titles[index][2] === group)))));
  document.addEventListener("pointerdown", ({ target }) => {
    for (const each of tabs.querySelectorAll(".group.open")) if (!each.contains(target)) each.classList.remove("open");
  });
}

// Closes groups from the right, that of the selected tab last, until the others fit. Returns whether one is closed.
function fitGroups(tabs) {
  const groups = [...tabs.children].filter((each) => {
    const views = each.querySelectorAll("a:not([hidden])");
    each.hidden = !views.length;
    each.classList.remove("closed");
    each.classList.toggle("single", views.length === 1);
    return views.length;
  });
  const hasSelected = (group) => group.querySelector("[aria-selected=true]") !== null;
  const isWide = () => groups.reduce((sum, each) => sum + each.getBoundingClientRect().width, 0) > tabs.clientWidth;
  const closing = groups.filter((each) => !each.matches(".single")).reverse()
    .sort((one, other) => Number(hasSelected(one)) - Number(hasSelected(other)));
  for (const each of closing) {
    if (phone.matches || !isWide()) break;
    each.classList.add("closed");
  }
  return tabs.querySelector(".closed") !== null;
}

// Keeps the groups of tabs as wide as there is room for, and offers the menu of all views while not all of them are shown.
// Returns a function that is called with the names of the folded tabs.
export function allViewsMenu(tabs, titles) {
  const button = document.getElementById("all-views");
  const menu = document.getElementById("views-menu");
  const entry = ([name, title]) => h("a", { href: placeOf(name), autofocus: name === titles[0][0], "data-tab": name,
    onclick: () => menu.hidePopover() }, title);
  replace(menu, groupsOf(titles).map((group) => h("div", {}, h("h3", {}, group), titles.filter((each) => each[2] === group).map(entry))));
  byKeys(menu);
  let folded = [];
  let pending = 0; // what a change of the page needs several times before it is drawn is measured once
  const update = () => {
    pending = 0;
    button.hidden = !fitGroups(tabs) && !folded.length && !phone.matches;
    replace(button, folded.length && !phone.matches ? "☰ More" : "☰");
  };
  new ResizeObserver(update).observe(tabs);
  return (names) => {
    folded = names;
    button.setAttribute("aria-label", names.length ? "More: All views" : "All views");
    for (const each of menu.querySelectorAll("a")) each.classList.toggle("pale", names.includes(each.dataset.tab));
    pending ||= requestAnimationFrame(update);
  };
}

// The arrow keys move the focus from entry to entry, and letters move it to the entry that begins with them.
function byKeys(menu) {
  let typed = "";
  const startsWith = (text) => [...menu.querySelectorAll("a")].find((each) => each.textContent.toLowerCase().startsWith(text));
  menu.addEventListener("beforetoggle", () => { typed = ""; }); // `toggle` would be too late
  menu.addEventListener("keydown", (event) => {
    const links = [...menu.querySelectorAll("a")];
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    let next = step && links[(links.indexOf(document.activeElement) + step + links.length) % links.length];
    if (event.key.length === 1 && !event.ctrlKey && !event.metaKey) {
      typed = startsWith((typed + event.key).toLowerCase()) ? (typed + event.key).toLowerCase() : event.key.toLowerCase();
      next = startsWith(typed);
    }
    if (!next) return;
    next.focus();
    event.preventDefault();
  });
}

export function publishersMenu() {
  const button = document.getElementById("publishers");
  const menu = document.getElementById("publishers-menu");
  menu.append(publisherList());
  onPublishers((number) => {
    replace(button, `publishing ${number}`);
    button.hidden = number === 0;
    if (!number) menu.hidePopover?.(); // older browsers lack this method
  });
}
