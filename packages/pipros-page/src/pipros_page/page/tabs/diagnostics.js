// Components with their levels, values and history.

import { h, morph, panelHead, problemLine, replace, timeOfDay } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { foldable } from "../foldable.js";
import { nameTree } from "../name_tree.js";
import { LEVELS, levelDot, levelNow } from "../stale.js";
import { dataTable } from "../table.js";
import { toolbar } from "../toolbar.js";

const GRAVITY = [0, 1, 3, 2]; // by level: errors, then stale components, then warnings
const MAX_PROBLEMS = 200;
const PROBLEM_COLUMNS = [
  { title: "Level", text: ({ level }) => h("span", {}, levelDot(level), LEVELS[level] ?? String(level)),
    order: ({ level, name }) => `${9 - (GRAVITY[level] ?? 9)} ${name}` },
  { title: "Component", kind: "long", text: ({ name }) => name, order: ({ name }) => name },
  { title: "Message", kind: "long", text: ({ message }) => message, order: ({ message }) => message },
];
const DEEPEST = 50; // nodes choose the names; deeper levels are shown as one part

export function open(view, argument, context) {
  const error = problemLine();
  const counts = h("span", { class: "choices" });
  const problems = dataTable(PROBLEM_COLUMNS, { label: "Problems", keyOf: ({ name }) => name,
    onChoose: (name) => choose(name === selected ? "" : name), most: MAX_PROBLEMS, sortBy: "Level" });
  const worstFirst = h("div", { class: "scroll problems", hidden: true }, problems.element);
  const body = h("div", { class: "scroll params" }, h("ul", { class: "tree" }));
  const about = h("div", {});
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Component" }, about);
  const hint = emptyState("♥");
  view.append(h("div", { class: "column" }, toolbar({ title: "Diagnostics" }, counts), error.element, hint, worstFirst, body), side);
  let selected = argument;
  let components = [];
  let known = new Map(); // by name
  const reopen = foldable(body, choose);

  function draw() {
    const numbers = [0, 0, 0, 0];
    for (const component of components) numbers[component.level] += 1;
    replace(counts, LEVELS.map((name, level) => h("span", { class: numbers[level] ? `badge diagnostic-${level}` : "badge none" },
      `${name}: ${numbers[level]}`)));
    const bad = components.filter(({ level }) => level > 0);
    worstFirst.hidden = bad.length === 0;
    problems.show(bad);
    problems.mark(selected);
    morph(body.firstChild, tree(nameTree(components, ({ name }) => name, DEEPEST), ""));
    reopen();
    drawSide();
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
    const component = components.find(({ name }) => name && name === selected);
    side.hidden = !component;
    if (component) morph(about, details(component, () => choose("")));
  }

  context.watch("diagnostics", {}, (data) => {
    if (data.fresh) known = new Map();
    for (const component of data.components) known.set(component.name, component);
    if (!known.has(selected) && known.has(`/${selected}`)) selected = `/${selected}`; // an address without the slash
    components = [...known.values()].sort((a, b) => (a.name < b.name ? -1 : 1)).map((component) => {
      const { age, level } = levelNow(component, data);
      return { ...component, age: age.toFixed(1), level };
    });
    error.show(data.error);
    hint.hidden = components.length > 0;
    if (!components.length) replace(hint, `Nothing received yet on ${data.topics.join(" or ")}.`);
    draw();
  }, error.show, { always: true });
  return { go };
}

const worst = (branch) => Math.max(branch.item?.level ?? 0, ...[...branch.below.values()].map(worst));

function tree(branches, path) {
  return h("ul", { class: "tree" }, [...branches].sort(([a], [b]) => a.localeCompare(b)).map(([part, { below, item }]) => {
    const own = `${path}/${part}`;
    const label = [levelDot(worst({ below, item })), item
      ? h("button", { class: "plain", "data-name": item.name }, part, h("span", { class: "key" }, ` ${item.message}`)) : part];
    if (!below.size) return h("li", { "data-key": part }, label);
    return h("li", { "data-key": `${part}/` }, h("details", { "data-path": own }, h("summary", {}, label), tree(below, own)));
  }));
}

function details(component, onClose) {
  return h("div", {}, panelHead(component.name, onClose), h("p", {},
    h("span", { class: `badge diagnostic-${component.level}` }, LEVELS[component.level] ?? component.level), ` ${component.message}`),
    h("dl", {}, h("dt", {}, "Hardware"), h("dd", {}, component.hardware || "–"), h("dt", {}, "Age"), h("dd", {}, `${component.age} s`)),
    h("h3", {}, "History"), h("div", { class: "history", role: "img", "aria-label": `The newest ${component.history.length} levels` },
      component.history.map(([when, level]) =>
        h("span", { class: `dot diagnostic-${level}`, title: timeOfDay(when) }))),
    h("h3", {}, "Values"), h("table", {},
      component.values.map(([key, value]) => h("tr", {}, h("td", { class: "key" }, key), h("td", {}, value)))));
}
