// The search of the graph: it marks the nodes and topics whose names contain a text.

import { h, replace } from "../dom.js";

// `onHit(key)` is called if the user chooses the only hit, `onShowAll()` if hits that the options hide are to be shown.
export function graphSearch(canvas, onHit, onShowAll) {
  const hits = h("span", { class: "pale", role: "status" });
  const input = h("input", { type: "search", placeholder: "Search (/)", "aria-keyshortcuts": "/",
    "aria-label": "Search nodes and topics", oninput: () => mark(),
    onkeydown: (event) => { if (event.key === "Enter") showHit(); } });
  let names = []; // names of all nodes and topics, including hidden ones

  function mark() {
    const found = canvas.find(input.value);
    const wanted = input.value.trim().toLowerCase();
    const hidden = wanted ? names.filter((name) => name.toLowerCase().includes(wanted)).length - found.length : 0;
    replace(hits, wanted ? `${found.length} found` : "", hidden > 0
      ? [", ", h("button", { class: "plain", title: "Show everything that the options hide", onclick: onShowAll },
        `${hidden} hidden: show`)] : null);
    return found;
  }

  // Goes to the first hit, and selects it if it is the only one.
  function showHit() {
    const found = mark();
    canvas.centre(found[0]);
    if (found.length === 1) onHit(found[0]);
  }

  return { input, hits, setNames(next) { names = next; mark(); } };
}
