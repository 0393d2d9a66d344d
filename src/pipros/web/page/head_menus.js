// Menus in the head of the page: all views (if the tabs do not fit), and the running publishers.

import { h, replace } from "./dom.js";
import { placeOf } from "./place.js";
import { onPublishers, publisherList } from "./publishers.js";

// Shows the button for the menu of all views while the tabs need more room than there is, or some of them are folded.
// Returns a function that is called with the names of the folded tabs.
export function allViewsMenu(tabs, titles) {
  const button = document.getElementById("all-views");
  const menu = document.getElementById("views-menu");
  replace(menu, titles.map(([name, title]) => h("a", { href: placeOf(name), onclick: () => menu.hidePopover() }, title)));
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

export function publishersMenu() {
  const button = document.getElementById("publishers");
  const menu = document.getElementById("publishers-menu");
  menu.append(publisherList());
  onPublishers((number) => {
    replace(button, `publishing ${number}`);
    button.hidden = number === 0;
    if (!number) menu.hidePopover?.(); // older browsers lack it
  });
}
