// The panel that shows and sets the levels of a node's loggers.

import { h, panelHead, replace, uniqueId } from "./dom.js";

const LEVELS = ["debug", "info", "warn", "error", "fatal"];

// Fills `side`, and offers the names in `nodes`. If `ofNode` is not empty, its loggers are shown at once. `error` is a problemLine.
export function loggerLevels(side, context, nodes, ofNode, error, onClose) {
  const { control } = context;
  const choice = h("input", { value: ofNode, placeholder: "/node", "aria-label": "Node", list: uniqueId("logger-nodes"),
    onchange: () => list() });
  const names = h("datalist", { id: choice.getAttribute("list") }, nodes.map((name) => h("option", { value: name })));
  const found = h("div", {});
  replace(side, panelHead("Logger levels", onClose), control ? null : h("p", { class: "key" }, "Start with --control to change levels."),
    choice, names, found);

  const ask = context.newest();
  async function list() {
    try {
      const loggers = await ask("loggers", { name: choice.value });
      replace(found, h("table", {}, loggers.map((logger) => h("tr", {}, h("td", {}, logger.name), h("td", {}, levelChoice(logger))))));
    } catch (problem) {
      replace(found, h("p", { class: "error" }, problem.message));
    }
  }

  const levelChoice = (logger) => h("select", { disabled: !control, "aria-label": `Level of ${logger.name}`,
    onchange: ({ target }) => set(logger.name, target.value) },
  LEVELS.map((level) => h("option", { value: level, selected: level === logger.level.toLowerCase() }, level)));

  async function set(logger, level) {
    if (!await error.attempt(() => context.act("set_logger_level", { name: choice.value, logger, level }))) list();
  }

  if (ofNode) list();
}
