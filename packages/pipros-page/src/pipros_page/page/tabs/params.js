// Parameters as a tree, with recent changes marked.

import { runningNote } from "../bags/running_note.js";
import { bytes, h, morph, problemLine } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { foldable } from "../foldable.js";
import { nameTree } from "../name_tree.js";
import { sections } from "../sections.js";
import { toolbar } from "../toolbar.js";

const MARKED_MS = 4000;
const LONG = 300; // a longer value (in characters) is shortened until the user opens it
const SHOWN = 80;

export function open(view, argument, context) {
  const { control } = context;
  const search = h("input", { type: "search", placeholder: "Search", value: argument, "aria-label": "Search parameters",
    oninput: () => draw() });
  const error = problemLine();
  const body = h("div", { class: "scroll params" }, h("div", {}));
  const name = h("input", { placeholder: "/name", "aria-label": "Name", spellcheck: "false", oninput: () => { value.required = false; } });
  const value = h("input", { placeholder: "value in YAML", "aria-label": "Value", spellcheck: "false", size: 24 });
  view.append(h("div", { class: "column" }, runningNote(context.signal),
    toolbar({ title: "Parameters" }, sections("params"), search, h("span", { class: "spring" }),
    control ? h("form", { class: "choices", onsubmit: (event) => {
      event.preventDefault();
      change("set_param", { name: name.value, value: value.value });
    } }, name, value, h("button", {}, "Set"),
      h("button", { type: "button", onclick: () => change("delete_param", { name: name.value }) }, "Delete")) : null),
    error.element, body));
  let params = {};
  let changed = new Map();
  let isFirst = true;
  const reopen = foldable(body, edit);

  const change = (action, args) => error.attempt(() => context.act(action, args));

  function draw() {
    const wanted = search.value.trim().toLowerCase();
    const names = Object.keys(params).filter((key) => !wanted || `${key} ${params[key]}`.toLowerCase().includes(wanted));
    const none = emptyState("≔", wanted ? "No parameter matches." : "There are no parameters.");
    morph(body.firstChild, h("div", {}, names.length ? branch(nameTree(names, (key) => key), "", { params, changed, control }) : none));
    reopen();
  }

  function edit(key) {
    name.value = key;
    value.required = params[key].includes("…"); // a shortened value must not be written back, nor none in its place
    value.value = value.required ? "" : params[key];
    value.focus();
  }

  context.watch("params", {}, (data) => {
    if (data.error) { error.show(data.error); return; }
    error.show(data.more ? `${data.more} more parameters are not shown.` : "");
    const now = Date.now();
    for (const [key, item] of Object.entries(data.params)) {
      if (!isFirst && item !== params[key]) changed.set(key, now);
    }
    isFirst = false;
    params = data.params;
    draw();
    setTimeout(() => { changed = new Map([...changed].filter(([, when]) => Date.now() - when < MARKED_MS)); draw(); }, MARKED_MS + 100);
  }, error.show);
  return { go: (text) => { search.value = text; draw(); } };
}

// Returns the list of a namespace `ns`. `state`: `params`, name to text; `changed`, a map with the marked names; and `control`.
function branch(level, ns, state) {
  const { params, changed, control } = state;
  return h("ul", { class: "tree" }, [...level].map(([part, { below, item }]) => {
    const path = `${ns}/${part}`;
    if (below.size) {
      return h("li", { "data-key": `${part}/` },
        h("details", { "data-path": path }, h("summary", {}, `${part}/`), branch(below, path, state)));
    }
    const text = params[item];
    const isLong = text.length > LONG;
    const shown = [h("span", { class: "key" }, `${part}: `), isLong ? null : text];
    return h("li", { "data-key": part, class: changed.has(item) ? "changed" : "" },
      control ? h("button", { class: "plain", title: "Edit", "data-name": item }, shown) : shown,
      isLong ? h("details", { class: "long-value", "data-value": item },
        h("summary", {}, `${text.slice(0, SHOWN)} … ${bytes(text.length)}`), text) : null);
  }));
}
