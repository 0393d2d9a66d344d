// The nodes of running launches: their states, exit codes and output; with control, they can be stopped and restarted.

import { h, morph, panelHead, problemLine, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { sections } from "../sections.js";
import { dataTable } from "../table.js";
import { toolbar } from "../toolbar.js";

const NOTHING = "No roslaunch of this user runs nodes with this master on this machine.";
const COLUMNS = [
  { title: "Node", kind: "name", text: (row) => row.node, order: (row) => row.node },
  { title: "State", text: stateText, order: (row) => row.state },
  { title: "Exit code", kind: "number", text: (row) => row.exit_code ?? "–", order: (row) => row.exit_code },
  { title: "PID", kind: "number", text: (row) => row.pid, order: (row) => row.pid },
  { title: "Starts", kind: "number", text: (row) => row.starts, order: (row) => -row.starts },
  { title: "Program", kind: "name mono", text: (row) => row.program, order: (row) => row.program },
  { title: "Launch file", kind: "name", text: (row) => row.files, order: (row) => row.files },
];

const keyOf = (row) => `${row.launch}:${row.name}`;

function stateText(row) {
  const hasFailed = row.state === "exited" && row.exit_code !== 0;
  const traits = [row.required ? "required" : "", row.respawn ? "respawns" : ""].filter(Boolean).join(", ");
  return h("span", { class: hasFailed ? "error-text" : null }, row.state, traits ? h("span", { class: "key" }, ` (${traits})`) : "");
}

export function open(view, argument, context) {
  const error = problemLine();
  const hint = emptyState("▷");
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Launched node",
    onkeydown: (event) => { if (event.key === "Escape") choose(""); } });
  const table = dataTable(COLUMNS, { label: "Launched nodes", keyOf, onChoose: (key) => choose(key === selected ? "" : key),
    sortBy: "Node" });
  view.append(h("div", { class: "column" }, toolbar({ title: "Launches" }, sections("launches"), h("span", { class: "spring" }),
    table.csvButton("launches")), error.element, hint,
    h("div", { class: "scroll" }, table.element)), side);
  let rows = [];
  let selected = "";
  let shown = ""; // what the side panel shows
  let panel = { draw: (_row) => {}, close: () => {} };

  function choose(key) {
    context.remember(key);
    go(key);
  }

  function go(key) {
    selected = key;
    table.mark(key);
    draw();
  }

  function draw() {
    const row = rows.find((each) => keyOf(each) === selected);
    side.hidden = !row;
    if (shown !== (row ? selected : "")) {
      panel.close();
      replace(side);
      shown = row ? selected : "";
      if (row) panel = launchedNode(side, row, context, () => choose(""));
    }
    if (row) panel.draw(row);
  }

  context.watch("launches", {}, (data) => {
    rows = data.nodes;
    error.show(data.error);
    hint.hidden = rows.length > 0 || Boolean(data.error);
    replace(hint, NOTHING);
    table.show(rows);
    draw();
  }, error.show);
  go(argument);
  return { go };
}

// Fills `side` with the buttons and the output of a node.
function launchedNode(side, { launch, name, node }, context, onClose) {
  const error = problemLine("p");
  const figures = h("div", {}, h("dl", {}));
  const output = h("div", {}, h("div", {}));
  const button = (title, action) => h("button", { disabled: !context.control, onclick: () =>
    error.attempt(() => context.act(action, { launch, node: name })) }, title);
  const stop = button("Stop", "stop_launched");
  side.append(panelHead(node, onClose), h("p", {}, button("Restart", "restart_launched"), " ", stop,
    context.control ? "" : " Start with --control to stop and restart nodes."),
    error.element, figures, h("h3", {}, "Output"), output);
  const close = context.watch("launch_output", { launch, node: name }, (data) => {
    morph(output.firstChild, h("div", {}, data.output.length
      ? data.output.map(([source, text]) => [h("p", { class: "key" }, source), h("pre", { class: "mono whole" }, text)])
      : h("span", { class: "key" }, "none; nodes with output=\"screen\" write to the terminal of roslaunch")));
  }, error.show);
  function draw(row) {
    stop.disabled = !context.control || row.state === "stopped" || row.state === "exited";
    morph(figures.firstChild, h("dl", {}, Object.entries({ State: stateText(row), "Exit code": row.exit_code ?? "–", PID: row.pid,
      Starts: row.starts, Program: row.program, "Launch file": row.files, roslaunch: launch })
      .map(([key, value]) => [h("dt", {}, key), h("dd", {}, value)])));
  }
  return { draw, close };
}
