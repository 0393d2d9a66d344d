// Actions: their goals with feedback and results, and a form to send goals.

import { runningNote } from "../bags/running_note.js";
import { copiesValues } from "../copy.js";
import { h, morph, panelHead, problemLine, replace, uniqueId } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { dataTable } from "../table.js";
import { tree } from "../message_values.js";
import { yaml } from "./services.js";
import { toolbar } from "../toolbar.js";

const MAX_ROWS = 500;
const ENDING = /ActionGoal$/;
const COLUMNS = [
  { title: "Action", kind: "name", text: ([name]) => name, order: ([name]) => name },
  { title: "Type", kind: "name mono", text: ([, type]) => type.replace(ENDING, "Action"), order: ([, type]) => type },
  { title: "Node", kind: "name", text: ([, , node]) => node, order: ([, , node]) => node },
];

export function open(view, argument, context) {
  const filter = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter actions", oninput: () => draw() });
  const error = problemLine();
  const none = emptyState("◎");
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Action",
    onkeydown: (event) => { if (event.key === "Escape") choose(""); } });
  const table = dataTable(COLUMNS, { label: "Actions", keyOf: ([name]) => name, onChoose: (name) => choose(name === selected ? "" : name),
    most: MAX_ROWS, sortBy: "Action" });
  table.element.classList.add("fixed");
  view.append(h("div", { class: "column" }, runningNote(context.signal),
    toolbar({ title: "Actions" }, filter, h("span", { class: "spring" }), table.csvButton("actions")),
    error.element, none,
    h("div", { class: "scroll" }, table.element)), side);
  let actions = [];
  let selected = "";
  let panel = null; // of the selected action

  function draw() {
    const wanted = filter.value.trim().toLowerCase();
    none.hidden = actions.length > 0;
    replace(none, "There are no actions.");
    table.show(actions.filter((row) => row.join(" ").toLowerCase().includes(wanted)));
  }

  function choose(name) {
    context.remember(name);
    go(name);
    side.querySelector("textarea")?.focus();
  }

  const typeOf = (name) => actions.find(([each]) => each === name)?.[1] ?? "";

  function go(name) {
    selected = name;
    table.mark(name);
    panel?.close();
    side.hidden = !name;
    replace(side);
    panel = name ? actionPanel(side, name, context, () => choose("")) : null;
    panel?.takeType(typeOf(name));
  }

  context.watch("actions", {}, (data) => {
    actions = data.actions;
    error.show(data.error ? `The master does not answer: ${data.error}` : "");
    draw();
    panel?.takeType(typeOf(selected));
  }, error.show);
  if (argument) go(argument);
  return { go };
}

// Fills `side`; returns functions that end the updates and take the action's type, which is empty while its server is unknown.
// Another type must not end the updates: the server cancels goals that have a time limit when no browser shows the action.
function actionPanel(side, name, context, onClose) {
  let type = null;
  let template = ""; // the goal that the user has not edited
  const typeText = h("dd", {});
  const error = problemLine("p");
  const label = uniqueId("goal");
  const goal = h("textarea", { rows: 6, class: "mono", id: label, "aria-label": "Goal in YAML", spellcheck: "false" });
  const cancel = (id) => error.attempt(() => context.act("cancel_goal", { name, id }));
  const send = h("button", { disabled: true, title: "Control+Enter", "aria-keyshortcuts": "Control+Enter",
    onclick: () => error.attempt(() => context.act("send_goal", { name, type, goal: goal.value })) }, "Send goal");
  const cancelAll = h("button", { disabled: !context.control, onclick: () => cancel("") }, "Cancel all");
  const live = copiesValues(h("div", {}, h("div", {})), error.show);
  live.addEventListener("click", (event) => {
    const button = event.target instanceof Element ? event.target.closest("button[data-goal]") : null;
    if (button) cancel(button.getAttribute("data-goal"));
  });
  side.append(panelHead(name, onClose), h("dl", {}, h("dt", {}, "Type"), typeText),
    h("h3", {}, "Goal"), goal, h("p", {}, send, " ", cancelAll, context.control ? "" : " Start with --control to send goals."),
    error.element, live);

  const ask = context.newest();

  function takeType(found) {
    if (found === type) return;
    type = found;
    replace(typeText, type.replace(ENDING, "Action") || "unknown");
    send.disabled = !context.control || !type;
    if (type) error.attempt(async () => {
      const fresh = yaml(await ask("message", { type: found.replace(ENDING, "Goal") }));
      if (goal.value !== template) return;
      goal.value = template = fresh;
      if (document.activeElement === goal) goal.select();
    });
  }

  const close = context.watch("action", { name },
    (data) => morph(live.firstChild, h("div", {}, contents(data, context.control))), error.show);
  return { close, takeType };
}

function contents({ goals, feedback, result }, control) {
  return [
    h("h3", {}, "Goals"), goals.length ? h("ul", { class: "tree goals" }, goals.map((goal) => goalEntry(goal, control)))
      : h("span", { class: "key" }, "none"),
    h("h3", {}, "Newest feedback"), content(feedback),
    h("h3", {}, "Newest result"), content(result),
  ];
}

const goalEntry = (goal, control) => h("li", { "data-key": goal.id },
  h("span", { class: `state-${goal.open ? "open" : goal.status}` }, goal.status), " ", goal.id,
    goal.text ? h("span", { class: "key" }, ` ${goal.text}`) : "", " ",
  h("button", { "data-goal": goal.id, hidden: !goal.open || !control, "aria-label": `Cancel ${goal.id}` }, "Cancel"));

const content = (found) => (found
  ? h("div", {}, found.goal ? h("p", { class: "key" }, `${found.goal.status}: ${found.goal.id} ${found.goal.text}`) : "",
    tree(found.message))
  : h("span", { class: "key" }, "none received yet"));
