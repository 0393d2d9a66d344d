// The menu of layouts: kept by the server under names, and as files.

import { download, h, replace, uniqueId } from "../dom.js";

const VERSION = 1;
const LARGEST_FILE = 100000;

// Returns the menu with its button. `current()` is the text of the layout; `onOpen(text)` opens another; `error` is a problemLine.
export function storedLayouts(context, current, onOpen, { show, attempt }) {
  const choice = h("select", { "aria-label": "Stored layouts", "aria-keyshortcuts": "o",
    onchange: () => attempt(async () => {
    name.value = choice.value;
    onOpen((await context.act("layout", { name: choice.value })).panels);
  }) });
  const name = h("input", { size: 12, placeholder: "Name", "aria-label": "Name of the layout", "aria-keyshortcuts": "n",
    spellcheck: "false", maxlength: 60, autofocus: true });
  const save = h("button", {}, "Save");
  const remove = h("button", { type: "button",
    onclick: () => attempt(async () => list(await context.act("delete_layout", { name: name.value.trim() }))) }, "Delete");
  const file = h("input", { type: "file", hidden: true, "aria-label": "Layout file", accept: ".json", onchange: () => attempt(load) });

  function list({ names, may_save: may }, chosen = "") {
    replace(choice, h("option", { value: "", disabled: true, selected: !chosen }, names.length ? "Open a layout" : "No layouts stored"),
      names.map((each) => h("option", { value: each, selected: each === chosen }, each)));
    for (const each of [name, save, remove]) each.disabled = !may;
    save.title = may ? "Store the layout on the server" : "This page may not store layouts; export it instead";
  }

  async function load() {
    const [chosen] = file.files;
    file.value = "";
    if (chosen.size > LARGEST_FILE) throw new Error(`${chosen.name} has ${chosen.size} bytes; the limit for a layout is ${LARGEST_FILE}`);
    const content = JSON.parse(await chosen.text());
    if (content?.pipros_layout !== VERSION || typeof content.panels !== "string")
      throw new Error(`${chosen.name} is not a layout file: pipros_layout must be ${VERSION}, and panels a string`);
    onOpen(content.panels);
  }

  const content = () => `${JSON.stringify({ pipros_layout: VERSION, panels: current() })}\n`;
  const saveFile = () => download(`${name.value.trim() || "layout"}.json`, content(), "application/json");

  context.act("layouts").then(list, (problem) => show(problem.message));
  const menu = h("form", { popover: "", id: uniqueId("layouts"), class: "layouts", "aria-label": "Layouts", onsubmit: (event) => {
    event.preventDefault();
    attempt(async () => list(await context.act("save_layout", { name: name.value.trim(), panels: current() }), name.value.trim()));
  } }, choice, h("span", { class: "buttons" }, name, save, remove), h("span", { class: "buttons" },
    h("button", { type: "button", title: "Save the layout as a file", onclick: saveFile }, "Export"),
    h("button", { type: "button", title: "Open a layout from a file", onclick: () => file.click() }, "Import")), file);
  return h("span", {}, h("button", { popovertarget: menu.id, title: "Open, store, export and import layouts (o, n)" }, "Layout ▾"), menu);
}
