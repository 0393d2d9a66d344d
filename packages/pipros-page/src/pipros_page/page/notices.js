// The bell in the head: what became stale, came back or failed in the last minute, and what is stale now.

import { h, morph, replace, s, timeOfDay } from "./dom.js";
import { live } from "./live.js";
import { bellText, placeOfNotice } from "./notice_texts.js";

const BELL = "M8 1a4 4 0 0 0-4 4c0 4-2 5-2 6h12c0-1-2-2-2-6a4 4 0 0 0-4-4M6.5 12.5a1.5 1.5 0 0 0 3 0z";
const WORDS = { stale: "stale", back: "came back", error: "error" };
const QUIET = "Nothing became stale, came back or failed in the last minute.";

const row = (notice, when) => h("li", { "data-key": `${notice.what} ${notice.kind} ${notice.name} ${notice.text ?? ""}` },
  h("a", { href: placeOfNotice(notice) }, h("span", { class: "key" }, when),
    h("span", { class: `notice-${notice.what}` }, WORDS[notice.what]), h("span", {}, `${notice.kind} ${notice.name}`,
      notice.text ? h("span", { class: "key" }, ` ${notice.text}`) : null), notice.count > 1 ? h("b", {}, `×${notice.count}`) : null));

function list(title, rows) {
  return rows.length ? [h("h3", { "data-key": title }, title), h("ul", { "data-key": `${title}:` }, rows)] : [];
}

const contents = ({ changes, stale, count }) => h("div", {},
  changes.length ? null : h("p", { class: "key", "data-key": "quiet" }, QUIET),
  list("Last minute", changes.map((each) => row(each, timeOfDay(each.when_s)))),
  list(`Stale now: ${count}`, stale.map(([kind, name, since]) => row({ what: "stale", kind, name },
    `since ${timeOfDay(since)}`))));

export function bell() {
  const button = document.getElementById("bell");
  const menu = document.getElementById("bell-menu");
  const number = h("span", {});
  button.append(s("svg", { viewBox: "0 0 16 16", width: 15, height: 15, "aria-hidden": "true" }, s("path", { d: BELL })), number);
  menu.append(h("div", {}));
  menu.addEventListener("click", ({ target }) => { if (target instanceof Element && target.closest("a")) menu.hidePopover?.(); });
  menu.addEventListener("keydown", (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const links = [...menu.querySelectorAll("a")];
    links[Math.max(0, links.findIndex((each) => each === document.activeElement) + step)]?.focus();
  });
  menu.addEventListener("toggle", (event) => {
    if (/** @type {any} */ (event).newState === "open") (menu.querySelector("a") ?? menu).focus();
  });
  live.watch("notices", {}, (data) => {
    const text = bellText(data.changes, data.count);
    button.setAttribute("aria-label", text);
    button.title = `${text} (a)`;
    const worst = data.changes.some(({ what }) => what === "error") ? "error" : data.changes.length || data.count ? "stale" : "";
    button.className = worst && `notice-${worst}`;
    const shown = data.changes.length || data.count;
    replace(number, shown > 99 ? "99+" : shown ? String(shown) : "");
    morph(menu.firstChild, contents(data));
  });
}
