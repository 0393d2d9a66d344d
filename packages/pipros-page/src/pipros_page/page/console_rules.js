// Saved filters of the Console. The server keeps them as layouts of one panel, whose names begin with "console ", so that all
// browsers have them, and Panels can open them, too.

import { h, panelHead, problemLine, replace } from "./dom.js";
import { layoutText, leaf, leavesOf, parsedLayout } from "./panels/layout.js";

const PREFIX = "console ";

// Convert the filters of an address to the text that the server keeps, and back.
export const storedRules = (argument) => layoutText(leaf("console", argument));
export function rulesIn(text) {
  const [only] = leavesOf(parsedLayout(text, ["console"]));
  return only?.argument ?? "";
}

// Fills `side` with the saved rules. `current()` returns the filters as in an address; `onApply(argument)` is called with those of a rule.
export function rulesPanel(side, context, current, onApply, onClose) {
  const error = problemLine("p");
  const list = h("ul", { class: "tree" });
  const name = h("input", { placeholder: "Name", "aria-label": "Name of the rules", maxlength: 50, spellcheck: "false" });
  const save = h("button", {}, "Save the filters");
  const form = h("form", { class: "choices", onsubmit: (event) => { event.preventDefault(); error.attempt(store); } }, name, save);
  replace(side, panelHead("Rules", onClose), h("p", { class: "key" }, "Levels and filters under a name, for all browsers."),
    error.element, list, form);

  async function store() {
    show(await context.act("save_layout", { name: PREFIX + name.value.trim(), panels: storedRules(current()) }));
    name.value = "";
  }

  function show({ names, may_save: maySave }) {
    const kept = names.filter((each) => each.startsWith(PREFIX));
    form.hidden = !maySave;
    replace(list, kept.length ? kept.map((each) => entry(each, maySave)) : h("li", { class: "key" }, "No rules are saved."));
  }

  function entry(stored, maySave) {
    const shown = stored.slice(PREFIX.length);
    return h("li", {}, h("button", { class: "plain", onclick: () => error.attempt(async () =>
      onApply(rulesIn((await context.act("layout", { name: stored })).panels))) }, shown), " ",
    maySave ? h("button", { class: "plain", "aria-label": `Delete the rules ${shown}`,
      onclick: () => error.attempt(async () => show(await context.act("delete_layout", { name: stored }))) }, "×") : null);
  }

  error.attempt(async () => show(await context.act("layouts")));
}
