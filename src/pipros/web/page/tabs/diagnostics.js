// Components with their levels, values and history.

import { h, replace } from "../dom.js";

const LEVELS = ["OK", "Warning", "Error", "Stale"];
const STALE = 3;
const DEEPEST = 50; // nodes choose the names; deeper levels are shown as one part

export function open(view, argument, context) {
  const error = h("div", { class: "error", role: "alert" });
  const counts = h("div", { class: "bar" });
  const body = h("div", { class: "scroll params" });
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Component" });
  const hint = h("div", { class: "note" });
  view.append(h("div", { class: "column" }, counts, error, hint, body), side);
  let selected = argument;
  let components = [];
  let known = new Map(); // by name
  const closed = new Set();

  function draw() {
    const numbers = [0, 0, 0, 0];
    for (const component of components) numbers[component.level] += 1;
    replace(counts, LEVELS.map((name, level) => h("span", { class: numbers[level] ? `badge diagnostic-${level}` : "badge none" }, `${name}: ${numbers[level]}`)));
    const root = { below: new Map() };
    for (const component of components) {
      let branch = root;
      const parts = component.name.split("/").filter(Boolean);
      if (parts.length > DEEPEST) parts.push(parts.splice(DEEPEST - 1).join("/"));
      for (const part of parts) {
        if (!branch.below.has(part)) branch.below.set(part, { below: new Map() });
        branch = branch.below.get(part);
      }
      branch.component = component;
    }
    replace(body, tree(root, ""));
    drawSide();
  }

  const worst = (branch) => Math.max(branch.component?.level ?? 0, ...[...branch.below.values()].map(worst));

  function tree(branch, path) {
    return h("ul", { class: "tree" }, [...branch.below].sort(([a], [b]) => a.localeCompare(b)).map(([part, below]) => {
      const own = `${path}/${part}`;
      const label = [h("span", { class: `dot diagnostic-${worst(below)}` }), below.component
        ? h("button", { class: "plain", onclick: () => { choose(below.component.name); } }, part, h("span", { class: "key" }, ` ${below.component.message}`)) : part];
      if (!below.below.size) return h("li", {}, label);
      const details = h("details", { open: !closed.has(own), ontoggle: () => { if (details.isConnected) { if (details.open) closed.delete(own); else closed.add(own); } } }, h("summary", {}, label), tree(below, own));
      return h("li", {}, details);
    }));
  }

  function choose(name) {
    context.remember(name);
    go(name);
  }

  function go(name) {
    selected = name;
    draw();
  }

  function drawSide() {
    const component = components.find((each) => each.name === selected);
    side.hidden = !component;
    if (!component) return;
    replace(side, h("h2", {}, component.name), h("p", {}, h("span", { class: `badge diagnostic-${component.level}` }, LEVELS[component.level] ?? component.level), ` ${component.message}`),
      h("dl", {}, h("dt", {}, "Hardware"), h("dd", {}, component.hardware || "–"), h("dt", {}, "Age"), h("dd", {}, `${component.age} s`)),
      h("h3", {}, "History"), h("div", { class: "history", role: "img", "aria-label": `The newest ${component.history.length} levels` }, component.history.map(([when, level]) => h("span", { class: `dot diagnostic-${level}`, title: new Date(when * 1000).toLocaleTimeString() }))),
      h("h3", {}, "Values"), h("table", {}, component.values.map(([key, value]) => h("tr", {}, h("td", { class: "key" }, key), h("td", {}, value)))),
      h("button", { onclick: () => { choose(""); } }, "Close"));
  }

  context.watch("diagnostics", {}, (data) => {
    if (data.fresh) known = new Map();
    for (const component of data.components) known.set(component.name, component);
    components = [...known.values()].sort((a, b) => (a.name < b.name ? -1 : 1)).map((component) => {
      const age = data.now - component.last;
      return { ...component, age: age.toFixed(1), level: age > data.stale ? STALE : component.level };
    });
    replace(error, data.error);
    hint.hidden = components.length > 0;
    replace(hint, `Nothing came yet on ${data.topics.join(" or ")}.`);
    draw();
  }, (problem) => replace(error, problem), { always: true });
  return { go };
}
