// The tree of displays with their properties: switch, change, add, rename, copy, move, remove.

import { h, replace } from "../dom.js";
import { colourText, hexOf, parsedColour } from "./colours.js";
import { childrenOf, className } from "./properties.js";
import { DISPLAYS, GLOBAL, VIEWS } from "./schema.js";
import { SUPPORTED, makeDisplay } from "./registry.js";
import { topicOf, topicProperty } from "./topic_property.js";
import { whyNoData } from "../why_no_data.js";

const MAX_PARTS = 500;
const SIGNS = { ok: "✓", warning: "!", error: "✗" };

export class TreePanel {
  constructor(scene, context) {
    this.scene = scene;
    this.context = context;
    this.list = h("div", { class: "scene-displays", role: "group", "aria-label": "Displays" });
    this.search = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter displays", oninput: () => this.filter() });
    this.kinds = h("select", { "aria-label": "Add a display", onchange: () => this.addChosen() });
    this.element = h("div", { class: "scene-tree" }, h("div", { class: "scene-head" }, this.search, this.kinds), this.list);
    this.rows = new Map(); // display to {sign, details, statuses}
    this.topics = [];
    this.open = new WeakSet(); // configurations whose details are open
    this.dragged = null; // {display, parent} while a row is dragged
    context.watch("topics", {}, ({ topics }) => {
      this.topics = topics;
      this.offerKinds();
    });
    this.offerKinds();
  }

  // -- the list -----------------------------------------------------------------------------------------------------------

  load() {
    this.rows.clear();
    replace(this.list, this.globalRow(), this.scene.displays.map((display) => this.row(display, this.scene)), this.viewRow());
    this.showStatus();
    this.filter();
  }

  globalRow() {
    const body = h("div", { class: "scene-body" });
    this.fixedSign = h("span", { class: "scene-sign" });
    this.fixedText = h("span", { class: "pale" });
    this.fields(body, GLOBAL, this.scene.options, [], () => this.scene.reset());
    return this.details(this.scene.options.config, [this.fixedSign, h("b", {}, "Global Options")],
      [h("div", { class: "scene-statuses" }, "Fixed Frame: ", this.fixedText), body]);
  }

  viewRow() {
    const body = h("div", { class: "scene-body" });
    const config = this.scene.config.Views.Current;
    const draw = () => {
      const schema = VIEWS[className(this.scene.config.Views.Current.Class ?? "")] ?? VIEWS["rviz/Orbit"];
      replace(body);
      this.fields(body, schema, this.scene.view.properties, [], () => this.scene.invalidate());
      const saved = Array.isArray(this.scene.config.Views.Saved) ? this.scene.config.Views.Saved : [];
      body.append(h("div", { class: "scene-buttons" },
        h("button", { onclick: () => {
          this.scene.config.Views.Saved =
            [...saved, { ...structuredClone(this.scene.config.Views.Current), Name: `View ${saved.length + 1}` }];
          draw();
        } }, "Keep this view"),
        saved.map((each) => h("button", { onclick: () => {
          this.scene.setView({ ...structuredClone(each), Name: "Current View" });
          draw();
        } }, each.Name ?? "View"))));
    };
    draw();
    const row = this.details(config, [h("span", { class: "scene-sign" }), h("b", {}, "View")], [body]);
    row.addEventListener("toggle", () => row.open && draw());
    return row;
  }

  details(key, summary, content) {
    const element = h("details", { class: "scene-row", open: this.open.has(key) }, h("summary", {}, summary), content);
    element.addEventListener("toggle", () => (element.open ? this.open.add(key) : this.open.delete(key)));
    return element;
  }

  row(display, parent) {
    const sign = h("span", { class: "scene-sign" });
    const [statuses, body] = ["scene-statuses", "scene-body"].map((name) => h("div", { class: name }));
    const box = h("input", { type: "checkbox", checked: display.isEnabled, "aria-label": `Show ${display.name}`, onchange: () => {
      display.config.Enabled = display.config.Value = String(box.checked);
      const isInShownGroup = parent === this.scene || parent.isOn;
      if (box.checked && isInShownGroup) display.turnOn();
      else display.turnOff();
      this.scene.invalidate();
      this.showStatus();
    } });
    const name = h("span", { class: "scene-name" }, display.name);
    const kind = className(display.config.Class ?? "");
    this.fields(body, DISPLAYS[kind] ?? [], display.properties, [], () => {
      display.changed();
      this.scene.invalidate();
    });
    body.append(h("div", { class: "scene-buttons" },
      h("button", { onclick: () => this.rename(display, name) }, "Rename"),
      h("button", { onclick: () => this.copy(display, parent) }, "Copy"),
      h("button", { onclick: () => this.move(display, parent, -1), "aria-label": `Move ${display.name} up` }, "↑"),
      h("button", { onclick: () => this.move(display, parent, 1), "aria-label": `Move ${display.name} down` }, "↓"),
      h("button", { onclick: () => this.remove(display, parent) }, "Remove")));
    const parts = h("div", { class: "scene-parts" });
    const children = display.displays ? h("div", { class: "scene-children" }, display.displays.map((each) => this.row(each, display)))
      : null;
    const why = whyNoData(this.context);
    this.rows.set(display, { sign, statuses, why });
    const element = this.details(display.config, [sign, h("span", { class: "scene-box" }), name,
      h("span", { class: "pale" }, kind.replace(/^rviz\//, ""))], [statuses, why.element, children, body, parts]);
    this.makeDraggable(element.querySelector("summary"), display, parent);
    const offerParts = () => element.open && this.offerParts(display, parts);
    element.addEventListener("toggle", offerParts);
    parts.addEventListener("scene-refresh", offerParts);
    // The check box lies over its place in the summary: inside it, screen readers would not offer it.
    return h("div", { class: "scene-entry", "data-name": `${display.name} ${kind}`.toLowerCase() }, element, box);
  }

  // Shows a switch for each frame, link or namespace of a display.
  offerParts(display, parts) {
    const { key, names } = display.parts();
    const shown = `${key} ${names.join(" ")}`;
    if (!names.length) return;
    for (const box of parts.querySelectorAll("input")) box.checked = display.isPartShown(box.name, true);
    if (parts.dataset.shown === shown) return;
    parts.dataset.shown = shown;
    replace(parts, h("div", { class: "pale" }, key), names.slice(0, MAX_PARTS).map((name) => {
      const box = h("input", { type: "checkbox", name, checked: display.isPartShown(name, true), onchange: () => {
        display.switchPart(name, box.checked);
        this.scene.invalidate();
      } });
      return h("label", { class: "scene-field" }, h("span", {}, name || "(no name)"), box);
    }));
  }

  showStatus() {
    for (const parts of this.list.querySelectorAll("details[open] > .scene-parts")) parts.dispatchEvent(new Event("scene-refresh"));
    for (const [display, { sign, statuses, why }] of this.rows) {
      const level = display.isOn ? display.level : "";
      sign.className = `scene-sign scene-${level}`;
      replace(sign, SIGNS[level] ?? "");
      sign.title = level;
      why.offer(level === "ok" ? "" : topicOf(display));
      replace(statuses, [...display.statuses].slice(0, 100).map(([name, { level: each, text }]) =>
        h("div", { class: `scene-${each}` }, `${name}: ${text}`)));
    }
    const [level, text] = this.scene.fixedFrameStatus();
    this.fixedSign.className = `scene-sign scene-${level}`;
    replace(this.fixedSign, SIGNS[level]);
    const roots = level === "ok" ? [] : this.scene.otherRoots();
    replace(this.fixedText, text, roots.length ? `. Frames that exist: ${roots.slice(0, 5).join(", ")}` : "");
  }

  filter() {
    const wanted = this.search.value.trim().toLowerCase();
    for (const row of this.list.querySelectorAll(".scene-entry")) row.hidden = Boolean(wanted) && !row.dataset.name.includes(wanted)
      && !row.querySelector(`[data-name*="${CSS.escape(wanted)}"]`);
  }

  // -- changes of the list ------------------------------------------------------------------------------------------------

  offerKinds() {
    const byTopic = this.topics.flatMap(({ name, type }) => {
      const kind = SUPPORTED.find((each) => topicProperty(each)?.[3] === type);
      return kind ? [h("option", { value: `${kind} ${name}` }, `${name} (${shortName(kind)})`)] : [];
    });
    const count = byTopic.map((option) => option.value).join();
    if (this.offered === count) return;
    this.offered = count;
    replace(this.kinds, h("option", { value: "" }, "Add …"),
      h("optgroup", { label: "By type" }, SUPPORTED.map((kind) => h("option", { value: kind }, shortName(kind)))),
        byTopic.length ? h("optgroup", { label: "By topic" }, byTopic) : null);
  }

  addChosen() {
    const [kind, topic] = this.kinds.value.split(" ");
    this.kinds.value = "";
    if (!kind) return;
    const config = { Class: kind, Enabled: "true", Name: shortName(kind), Value: "true" };
    if (topic) config[topicProperty(kind)[0]] = topic;
    this.insert(config, this.scene, this.scene.displays.length);
  }

  insert(config, parent, at) {
    const display = makeDisplay(this.scene, config);
    parent.displays.splice(at, 0, display);
    parent.config.Displays.splice(at, 0, config);
    if (display.isEnabled && (parent === this.scene || parent.isOn)) display.turnOn();
    this.open.add(config);
    this.load();
    this.scene.invalidate();
  }

  copy(display, parent) {
    this.insert(structuredClone(display.config), parent, parent.displays.indexOf(display) + 1);
  }

  remove(display, parent) {
    const at = parent.displays.indexOf(display);
    display.close();
    parent.displays.splice(at, 1);
    parent.config.Displays.splice(at, 1);
    this.load();
    this.scene.invalidate();
  }

  // Lets a row be dragged before or after another one, or into a group.
  makeDraggable(summary, display, parent) {
    summary.draggable = true;
    const place = (event) => {
      const { top, height } = summary.getBoundingClientRect();
      const part = (event.clientY - top) / height;
      return display.displays && part > 0.25 && part < 0.75 ? "into" : part < 0.5 ? "before" : "after";
    };
    const mark = (text) => (text ? summary.setAttribute("data-drop", text) : summary.removeAttribute("data-drop"));
    const isAllowed = () => this.dragged && this.dragged.display !== display && !within(this.dragged.display, display);
    summary.addEventListener("dragstart", (event) => {
      this.dragged = { display, parent };
      event.dataTransfer.effectAllowed = "move";
      event.dataTransfer.setData("text/plain", display.name);
    });
    summary.addEventListener("dragend", () => { this.dragged = null; });
    summary.addEventListener("dragleave", () => mark(""));
    summary.addEventListener("dragover", (event) => {
      if (!isAllowed()) return;
      event.preventDefault();
      mark(place(event));
    });
    summary.addEventListener("drop", (event) => {
      mark("");
      if (!isAllowed()) return;
      event.preventDefault();
      const where = place(event);
      if (where === "into") this.moveTo(this.dragged, display, display.displays.length);
      else this.moveTo(this.dragged, parent, parent.displays.indexOf(display) + (where === "after" ? 1 : 0));
    });
  }

  // Moves a display to a place among the displays of the scene or a group.
  moveTo({ display, parent }, target, at) {
    const from = parent.displays.indexOf(display);
    const to = parent === target && from < at ? at - 1 : at;
    const listsOf = (owner) => [owner.displays, owner.config.Displays];
    listsOf(parent).forEach((list, index) => listsOf(target)[index].splice(to, 0, ...list.splice(from, 1)));
    if (display.isEnabled && (target === this.scene || target.isOn)) display.turnOn();
    else display.turnOff();
    this.dragged = null;
    this.load();
    this.scene.invalidate();
  }

  move(display, parent, by) {
    const at = parent.displays.indexOf(display);
    const to = at + by;
    if (to < 0 || to >= parent.displays.length) return;
    for (const list of [parent.displays, parent.config.Displays]) list.splice(to, 0, ...list.splice(at, 1));
    this.load();
  }

  rename(display, name) {
    const input = h("input", { type: "text", value: display.name, "aria-label": "New name" });
    const finish = () => {
      display.config.Name = input.value || display.name;
      this.load();
    };
    input.addEventListener("change", finish);
    input.addEventListener("blur", finish);
    replace(name, input);
    input.focus();
    input.select();
  }

  // -- properties -----------------------------------------------------------------------------------------------------------

  fields(body, schema, properties, path, onChange) {
    for (const definition of schema) {
      const [name, kind] = definition;
      const here = [...path, name];
      if (kind !== "group" && kind !== "names")
        body.append(h("label", { class: "scene-field" }, h("span", {}, name), this.field(definition, properties, here, onChange)));
      const children = childrenOf(definition);
      if (!children) continue;
      const inner = h("div", { class: "scene-nested" });
      if (kind === "group") inner.append(h("div", { class: "pale" }, name));
      this.fields(inner, children, properties, here, onChange);
      body.append(inner);
    }
  }

  field([, kind, , options], properties, path, onChange) {
    const value = properties.get(...path);
    const set = (next) => {
      properties.set(path, next);
      onChange();
    };
    if (kind === "bool" || kind === "switch") return h("input",
      { type: "checkbox", checked: value, onchange: (event) => set(event.target.checked) });
    if (kind === "enum" || kind === "choice") return h("select", { onchange: (event) => set(event.target.value) },
      [...new Set([value, ...options])].map((each) => h("option", { value: each, selected: each === value }, each || "automatic")));
    if (kind === "colour") return h("input", { type: "color", value: hexOf(value), title: colourText(value),
      onchange: (event) => set(parsedColour(event.target.value)) });
    if (kind === "vector") return h("span", { class: "scene-vector" },
      value.map((part, axis) => h("input", { type: "number", step: "any", value: part, "aria-label": `${path.at(-1)} ${"XYZ"[axis]}`,
        onchange: (event) => {
      value[axis] = Number(event.target.value) || 0;
      set(value);
    } })));
    if (kind === "int" || kind === "float") return h("input", { type: "number", step: kind === "int" ? 1 : "any", value,
      onchange: (event) => event.target.value !== "" && set(event.target.value) });
    const offers = kind === "topic" ? this.topics.filter((each) => each.type === options).map((each) => each.name) : kind === "frame"
      ? ["<Fixed Frame>", ...this.scene.frames.names()] : [];
    const list = h("datalist", { id: `offers-${Math.random().toString(36).slice(2)}` }, offers.map((each) => h("option", { value: each })));
    return h("span", {}, h("input", { type: "text", value, list: list.id, onchange: (event) => set(event.target.value) }), list);
  }
}

// Returns whether a display is in a group, or in one of its groups.
const within = (group, display) => Boolean(group.displays?.some((each) => each === display || within(each, display)));
const shortName = (kind) => kind.split("/").at(-1);
