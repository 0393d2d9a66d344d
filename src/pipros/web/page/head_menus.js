// Menus in the head of the page: all views (if some tabs do not fit or are hidden), and the running publishers.

import { h, replace } from "./dom.js";
import { placeOf } from "./place.js";
import { onPublishers, publisherList } from "./publishers.js";

// Shows the button for the menu of all views while the tabs need more room than there is, or some of them are folded.
// Returns a function that is called with the names of the folded tabs.
export function allViewsMenu(tabs, titles) {
  const button = document.getElementById("all-views");
  const menu = document.getElementById("views-menu");
  replace(menu, titles.map(([name, title], index) =>
    h("a", { href: placeOf(name), autofocus: index === 0, onclick: () => menu.hidePopover() }, title)));
  byKeys(menu);
  let folded = [];
  const update = () => {
    button.hidden = tabs.scrollWidth <= tabs.clientWidth && !folded.length;
    tabs.classList.toggle("more-before", tabs.scrollLeft > 1);
    tabs.classList.toggle("more-after", tabs.scrollLeft + tabs.clientWidth < tabs.scrollWidth - 1);
  };
  new ResizeObserver(update).observe(tabs);
  tabs.addEventListener("scroll", update);
  tabs.addEventListener("wheel", ({ deltaX, deltaY }) => { if (!deltaX) tabs.scrollLeft += deltaY; }, { passive: true });
  return (names) => {
    if (names.join() === folded.join()) return;
    folded = names;
    replace(button, names.length ? "☰ More" : "☰");
    button.setAttribute("aria-label", names.length ? "More: All views" : "All views");
    for (const [index, [name]] of titles.entries()) menu.children[index].classList.toggle("pale", names.includes(name));
    update();
  };
}

// The arrow keys move the focus from entry to entry, and letters move it to the entry that begins with them.
function byKeys(menu) {
  let typed = "";
  const startsWith = (text) => [...menu.children].find((each) => each.textContent.toLowerCase().startsWith(text));
  menu.addEventListener("beforetoggle", () => { typed = ""; }); // `toggle` would be too late
  menu.addEventListener("keydown", (event) => {
    const links = [...menu.children];
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
