// Acts of assistants that wait for a human, with buttons to approve or refuse them, and the acts of the past.

import { h, problemLine, replace, timeOfDay } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { dataTable } from "../table.js";
import { toolbar } from "../toolbar.js";

const NOTHING = "No act is waiting for approval. Assistants act through pipros mcp --policy FILE, on this machine and as this user.";
const BUTTONS = [["once", "Approve once"], ["minute", "Approve for a minute"], ["refuse", "Refuse"]];
const UNSEEN_MS = 700; // after a card has appeared or moved, nobody can have read it
const COLUMNS = [
  { title: "Time", text: ({ time }) => timeOfDay(time), order: ({ time }) => -time },
  { title: "Tool", text: ({ tool }) => tool, order: ({ tool }) => tool },
  { title: "Name", kind: "name", text: ({ name }) => name, order: ({ name }) => name },
  { title: "Outcome", text: ({ outcome, approval }) => (approval ? `${outcome}: ${approval}` : outcome), order: ({ outcome }) => outcome },
  { title: "Values or reason", kind: "long mono", text: ({ values, reason }) => reason ?? values, order: ({ values }) => values },
];

export function open(view, _argument, context) {
  const error = problemLine();
  const hint = emptyState("☑", NOTHING);
  const answered = h("div", { class: "note", role: "status" });
  const waiting = h("div", { class: "waiting", role: "list", "aria-label": "Acts that wait" });
  const past = h("div", { class: "scroll", hidden: true });
  const table = dataTable(COLUMNS, { label: "Acts", keyOf: ({ key }) => key, sortBy: "Time" });
  view.append(h("div", { class: "column" }, toolbar({ title: "Acts" }, h("span", { class: "spring" }), table.csvButton("acts")),
    error.element, hint, waiting, answered, past));
  past.append(table.element);
  const cards = new Map(); // by id

  // The buttons of a card that has appeared or moved act only after a moment: a click may be meant for another card.
  function settle() {
    for (const card of cards.values()) {
      if (card.top === card.element.offsetTop) continue;
      card.top = card.element.offsetTop;
      for (const each of card.buttons) each.disabled = true;
      clearTimeout(card.timer);
      if (context.control) card.timer = setTimeout(() => card.buttons.forEach((each) => { each.disabled = false; }), UNSEEN_MS);
    }
  }

  // The card of an act that waits. Its texts never change, only the time left.
  function cardOf(act) {
    const left = h("dd", {});
    const answer = async (verdict) => {
      if (await error.attempt(() => context.act("approve", { process: act.process, id: act.id, verdict })))
        replace(answered, `Answered: ${verdict}. This concerns ${act.tool} ${act.name}, act ${act.id}.`);
      settle();
    };
    const rows = { Tool: act.tool, Name: act.name, Values: act.values, Rule: act.rule,
      Master: act.here ? act.master : `${act.master}, not this page's` };
    const buttons = BUTTONS.map(([verdict, title]) => h("button", { disabled: true, onclick: () => answer(verdict) }, title));
    const element = h("section", { class: "note", role: "listitem", "aria-label": `${act.tool} ${act.name}` },
      h("dl", {}, Object.entries(rows).map(([key, value]) => [h("dt", {}, key), h("dd", {}, h("pre", { class: "mono whole" }, value))]),
        h("dt", {}, "Time left"), left),
      h("p", {}, buttons.map((each) => [each, " "]),
        context.control ? "" : "Start with --control to approve acts."));
    return { element, left, buttons, top: undefined, timer: undefined };
  }

  context.watch("acts", {}, (data) => {
    error.show(data.error);
    hint.hidden = data.waiting.length > 0 || Boolean(data.error);
    hint.classList.toggle("empty", !data.acts.length); // it would hide the acts of the past
    const known = new Set(data.waiting.map(({ id }) => id));
    for (const [id, { element }] of cards) {
      if (known.has(id)) continue;
      element.remove();
      cards.delete(id);
    }
    for (const act of data.waiting) {
      if (!cards.has(act.id)) {
        cards.set(act.id, cardOf(act));
        waiting.append(cards.get(act.id).element);
      }
      replace(cards.get(act.id).left, `${act.left_s.toFixed(0)} s`);
    }
    settle();
    past.hidden = !data.acts.length;
    table.show(data.acts.map((act, at) => ({ ...act, key: `${act.process} ${act.time} ${act.outcome} ${data.acts.length - at}` })));
  }, (problem) => {
    error.show(problem);
    settle();
  }, { always: true });
}
