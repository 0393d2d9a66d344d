// The menu of an interactive marker.

import { h } from "../dom.js";

const FEEDBACK_COMMAND = 0;
const MAX_ENTRIES = 200; // maximum number of entries of one level
const MAX_LEVELS = 10;

// Returns the menu as an element. `choose` is called with the id of an entry.
export function menuOf(entries, canAct, choose) {
  function itemsOf(parent, depth) {
    const own = entries.filter((each) => each.parent_id === parent && each.id !== parent).slice(0, MAX_ENTRIES);
    return own.flatMap((each) => {
      const children = depth < MAX_LEVELS ? itemsOf(each.id, depth + 1) : [];
      const item = children.length ? h("div", { class: "pale" }, textOf(each)) : button(each, canAct, choose);
      item.style.marginLeft = `${depth}rem`;
      return [item, ...children];
    });
  }
  return h("div", { class: "scene-menu", role: "menu" }, itemsOf(0, 0));
}

function button(entry, canAct, choose) {
  const isRefused = entry.command_type !== FEEDBACK_COMMAND;
  const title = isRefused ? "Starts a program, which the page does not do" : "";
  return h("button", { role: "menuitem", disabled: isRefused || !canAct, title, onclick: () => choose(entry.id) }, textOf(entry));
}

function textOf({ title: found }) {
  const [, box, title] = /^(\[[ x]\])?\s*(.*)$/s.exec(found) ?? [];
  return (box ? (box === "[x]" ? "☑ " : "☐ ") : "") + title;
}
