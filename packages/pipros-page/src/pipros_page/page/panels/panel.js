// One panel: the view of a tab with a bar to choose, move, split, enlarge and close it, and to show the controls of the view.

import { h } from "../dom.js";
import { placeIn } from "../place.js";
import { makeDraggable } from "./dragging.js";
import { TabContext } from "../tab_context.js";
import { viewModule } from "../views.js";

const CHOOSING = ["images", "plot"]; // views that show nothing before the user has chosen something with their controls
const ARROWS = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "above", ArrowDown: "below" };

class PanelContext extends TabContext {
  constructor(element, name, control, times, onRemember) {
    super(name, control, onRemember);
    this.element = element;
    this.times = times;
  }

  remember(argument, options) {
    this.onRemember(argument, options);
  }

  hears(event) {
    return super.hears(event) && this.element.contains(event.target);
  }
}

// `tabs` are names and titles. `board` has functions for the whole layout: `change(leaf, options)`, `split(id, side)`, `close(id)`,
// `enlarge(id)`, `move(id, target, side)`, `step(id, side)`, `follow(leaf, tab, argument)` and `mayControl(tab)`; and `times`, a TimeLink.
export function panel(first, tabs, board) {
  let leaf = first;
  let [tab, argument] = ["", ""]; // of the open view
  let context = null;
  let handle = null;
  let subjectOf = null; // of the tab's module: what the bar shows of an argument
  let isShown = true;
  const grip = h("button", { class: "plain grip", title: "Drag to move; the arrow keys move it, too",
    onkeydown: (event) => moveByKey(event, (side) => board.step(leaf.id, side)) }, "⠿");
  const choice = h("select", { "aria-label": "View", onchange: () => board.change({ ...leaf, tab: choice.value, argument: "" }) },
    tabs.map(([name, title]) => h("option", { value: name }, title)));
  const subject = h("span", { class: "subject pale" });
  const button = (text, title, onclick) => h("button", { class: "plain", "aria-label": title, title, onclick }, text);
  const enlarge = button("⤢", "Enlarge", () => board.enlarge(leaf.id));
  const gear = button("⚙", "Controls of this view", () => toggleControls(element, gear));
  const bar = h("div", { class: "panel-bar" }, grip, choice, subject, h("span", { class: "spring" }), gear,
    button("◫", "Split: another panel on the right", () => board.split(leaf.id, "right")),
    button("⊟", "Split: another panel below", () => board.split(leaf.id, "below")), enlarge,
    button("×", "Close", () => board.close(leaf.id)));
  let view = h("div", { class: "tab" });
  const element = h("section", { class: "panel" }, bar, view);

  element.addEventListener("click", (event) => followLink(event, (...place) => board.follow(leaf, ...place)));

  async function open() {
    context?.close();
    const opened = h("div", { class: `tab tab-${leaf.tab}` });
    view.replaceWith(opened);
    view = opened;
    [tab, argument, handle, subjectOf] = [leaf.tab, leaf.argument, null, null];
    context = new PanelContext(element, tab, board.mayControl(tab), board.times, (next, options) => {
      argument = next;
      board.change({ ...leaf, argument: next }, options);
    });
    const own = context;
    const module = await viewModule(tab);
    if (context !== own) return;
    subjectOf = module.subject ?? ((text) => text);
    handle = module.open(view, argument, context) ?? {};
    toggleControls(element, gear, !argument && CHOOSING.includes(tab));
    if (!isShown) context.hide();
    show(leaf); // the address may have changed in the meantime
  }

  // Shows the view of a leaf.
  function show(next) {
    leaf = next;
    const title = tabs.find(([name]) => name === leaf.tab)?.[1] ?? leaf.tab;
    choice.value = leaf.tab;
    element.setAttribute("aria-label", title);
    grip.setAttribute("aria-label", `Move ${title}`);
    if (leaf.tab !== tab) open();
    else if (leaf.argument !== argument && handle) {
      argument = leaf.argument;
      handle.go?.(argument);
    }
    for (const part of ["title", "textContent"]) subject[part] = subjectOf?.(leaf.argument) ?? "";
  }

  makeDraggable(element, grip, (target, side) => board.move(leaf.id, Number(target.dataset.id), side));

  return {
    element, show,
    get leaf() { return leaf; },
    get accepts() { return handle !== null; },
    setShown(value) {
      isShown = value;
      context?.[value ? "show" : "hide"]();
    },
    setEnlarged(value) {
      element.classList.toggle("enlarged", value);
      enlarge.setAttribute("aria-pressed", String(value));
    },
    close() {
      context?.close();
      context = null;
      element.remove();
    },
  };
}

// Shows or folds the controls of a panel's view.
function toggleControls(element, gear, isWanted = !element.classList.contains("tools")) {
  gear.hidden = !element.querySelector(".toolbar > :not(.title, .more)");
  element.classList.toggle("tools", isWanted);
  gear.setAttribute("aria-pressed", String(isWanted));
}

function moveByKey(event, step) {
  if (!(event.key in ARROWS)) return;
  event.preventDefault();
  step(ARROWS[event.key]);
  event.currentTarget.focus();
}

// A link to a view that another panel shows goes to that panel; other links open their tab.
function followLink(event, follow) {
  const link = event.target instanceof Element ? event.target.closest("a[href^='#']") : null;
  if (!link || event.ctrlKey || event.metaKey || event.shiftKey) return;
  const [name, argument] = placeIn(link.getAttribute("href"));
  if (follow(name, argument)) event.preventDefault();
}
