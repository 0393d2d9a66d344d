// One panel: the view of a tab with a bar to choose, move, split, enlarge and close it.

import { h, replace } from "../dom.js";
import { placeIn } from "../place.js";
import { TabContext } from "../tab_context.js";

const ARROWS = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "above", ArrowDown: "below" };
const CENTRE = 0.28; // part of a panel's size; a panel dropped nearer than this to an edge is placed at that edge

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
// `enlarge(id)`, `move(id, target, side)`, `step(id, side)`, `follow(tab, argument)`, `mayControl(tab)` and `times`.
export function panel(first, tabs, board) {
  let leaf = first;
  let tab = ""; // of the open view
  let argument = "";
  let context = null;
  let handle = null;
  let isShown = true;
  const grip = h("button", { class: "plain grip", title: "Drag to move; the arrow keys move it, too", onkeydown: (event) => {
    if (!(event.key in ARROWS)) return;
    event.preventDefault();
    board.step(leaf.id, ARROWS[event.key]);
    grip.focus();
  } }, "⠿");
  const choice = h("select", { "aria-label": "View", onchange: () => board.change({ ...leaf, tab: choice.value, argument: "" }) },
    tabs.map(([name, title]) => h("option", { value: name }, title)));
  const subject = h("span", { class: "subject pale" });
  const button = (text, title, onclick) => h("button", { class: "plain", "aria-label": title, title, onclick }, text);
  const enlarge = button("⤢", "Enlarge", () => board.enlarge(leaf.id));
  const bar = h("div", { class: "panel-bar" }, grip, choice, subject, h("span", { class: "spring" }),
    button("◫", "Split: another panel at the right", () => board.split(leaf.id, "right")),
    button("⊟", "Split: another panel below", () => board.split(leaf.id, "below")), enlarge,
    button("×", "Close", () => board.close(leaf.id)));
  let view = h("div", { class: "tab" });
  const element = h("section", { class: "panel" }, bar, view);

  // A link to a view that another panel shows goes to that panel; other links open their tab.
  element.addEventListener("click", (event) => {
    const link = event.target instanceof Element ? event.target.closest("a[href^='#']") : null;
    if (!link || event.ctrlKey || event.metaKey || event.shiftKey) return;
    const [name, wanted] = placeIn(link.getAttribute("href"));
    if (board.follow(leaf, name, wanted)) event.preventDefault();
  });

  async function open() {
    context?.close();
    const opened = h("div", { class: `tab tab-${leaf.tab}` });
    view.replaceWith(opened);
    view = opened;
    [tab, argument, handle] = [leaf.tab, leaf.argument, null];
    context = new PanelContext(element, tab, board.mayControl(tab), board.times, (next, options) => {
      argument = next;
      board.change({ ...leaf, argument: next }, options);
    });
    const own = context;
    const module = await import(`../tabs/${tab}.js`);
    if (context !== own) return;
    handle = module.open(view, argument, context) ?? {};
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
    replace(subject, leaf.argument);
    subject.title = leaf.argument;
    if (leaf.tab !== tab) open();
    else if (leaf.argument !== argument && handle) {
      argument = leaf.argument;
      handle.go?.(argument);
    }
  }

  // Dragging: while the pointer is over another panel, the place where this one would go is marked.
  let drop = null;
  const findDrop = ({ clientX, clientY }) => {
    const target = document.elementsFromPoint(clientX, clientY).map((each) => each.closest("section.panel")).find(Boolean);
    if (!(target instanceof HTMLElement) || target === element) return null;
    const bounds = target.getBoundingClientRect();
    const [x, y] = [(clientX - bounds.left) / bounds.width - 0.5, (clientY - bounds.top) / bounds.height - 0.5];
    const edge = Math.abs(x) > Math.abs(y) ? (x < 0 ? "left" : "right") : y < 0 ? "above" : "below";
    return { target, side: Math.max(Math.abs(x), Math.abs(y)) < CENTRE ? "centre" : edge };
  };
  const mark = (next) => {
    if (drop) delete drop.target.dataset.drop;
    drop = next;
    if (drop) drop.target.dataset.drop = drop.side;
  };
  grip.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    grip.setPointerCapture(event.pointerId);
    element.classList.add("dragged");
  });
  grip.addEventListener("pointermove", (event) => {
    if (element.classList.contains("dragged")) mark(findDrop(event));
  });
  for (const kind of ["pointerup", "pointercancel"]) grip.addEventListener(kind, () => {
    element.classList.remove("dragged");
    const found = drop;
    mark(null);
    if (found && kind === "pointerup") board.move(leaf.id, Number(found.target.dataset.id), found.side);
  });

  return {
    element, show,
    get leaf() { return leaf; },
    get accepts() { return handle !== null; },
    setShown(value) {
      isShown = value;
      if (value) context?.show();
      else context?.hide();
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
