// The row of controls of a view: its title, and what the user sets. What does not fit follows in further rows, which "…" opens. In a
// panel, the whole row is folded until the ⚙ of the panel is pressed: see `.panel .toolbar` in page.css.

import { h } from "./dom.js";

// Returns the row. `options`: `title`, shown while there is room for it; `tag`; and attributes of the element.
export function toolbar({ title = "", tag = "div", ...attributes }, ...controls) {
  const more = h("button", { type: "button", class: "more", "aria-label": "More controls", title: "More controls",
    "aria-expanded": "false", onclick: () => unfold(row, !row.classList.contains("open")) }, "…");
  const heading = h("h2", { class: "title" }, title);
  const row = h(tag, { ...attributes, class: `bar toolbar ${attributes.class ?? ""}` }, title ? heading : null, controls, more);
  let pending = 0;
  const changed = () => { pending ||= requestAnimationFrame(update); };

  // Marks the controls that are not in the first row.
  function update() {
    pending = 0;
    if (!row.checkVisibility()) return;
    heading.classList.remove("gone");
    let over = beyond(row);
    if (over.size) {
      heading.classList.add("gone");
      over = beyond(row);
    }
    for (const each of itemsOf(row)) each.classList.toggle("over", over.has(each));
    row.classList.toggle("full", over.size > 0);
  }

  new ResizeObserver(changed).observe(row);
  new MutationObserver(changed).observe(row, { subtree: true, childList: true, characterData: true, attributeFilter: ["hidden"] });
  return row;
}

// Shows all controls of a row, or only those in its first line. A row that is folded in a panel is shown first.
export function unfold(row, isOpen) {
  row.classList.toggle("open", isOpen);
  row.querySelector(":scope > .more").setAttribute("aria-expanded", String(isOpen));
  if (isOpen) row.closest(".panel")?.classList.add("tools");
}

// The elements that are laid out in a row: a group without a box stands for its children.
const itemsOf = (row) => [...row.children].flatMap((each) => (getComputedStyle(each).display === "contents" ? itemsOf(each) : [each]));

function beyond(row) {
  const items = itemsOf(row).filter((each) => !each.matches(".more, .spring") && each.offsetWidth > 0);
  const end = items.length ? items[0].offsetTop + items[0].offsetHeight : 0;
  return new Set(items.filter((each) => each.offsetTop >= end));
}
