// What a view shows while it has nothing to show: one sign, one line, and at most one action. The table or picture after it is hidden
// meanwhile: see `.empty` in page.css.

import { h } from "./dom.js";

export const LOADING = "Looking at the system …";

// Returns the element, which callers hide; they may replace its text. `action` is a link or a button.
export const emptyState = (sign, text = LOADING, action = null) =>
  h("div", { class: "note empty", role: "status", "data-sign": sign }, text, action);

export const emptyLink = (place, text) => h("a", { class: "action", href: `#${place}` }, text);
