// Views side by side. The address has the layout: see panels/layout.js.

import { mayControl } from "../app.js";
import { h, problemLine, replace } from "../dom.js";
import { appended, beside, layoutText, leaf, leavesOf, MAX_PANELS, moved, parsedLayout, placesOf, resized, withLeaf,
  without } from "../panels/layout.js";
import { emptyState } from "../empty_state.js";
import { LAYOUT } from "../home.js";
import { panel } from "../panels/panel.js";
import { storedLayouts } from "../panels/stored_layouts.js";
import { TimeLink } from "../panels/time_link.js";
import { OTHER_SECTIONS, TABS, tabOf } from "../sections.js";
import { toolbar } from "../toolbar.js";

const phone = matchMedia("(max-width: 700px)");
const STEP = 2; // percent that an arrow key moves a border
const FIRST = "row(topics~plot)";
const TITLES = [...TABS.filter(([name]) => name !== "panels"), ...OTHER_SECTIONS];
const NAMES = TITLES.map(([name]) => name);

export function open(view, argument, context) {
  const times = new TimeLink();
  const error = problemLine();
  const stage = h("div", { class: "panels" });
  const adder = h("select", { "aria-label": "Add a panel", onchange: () => {
    add(leaf(adder.value));
    adder.value = "";
  } }, h("option", { value: "" }, "Add a panel"), TITLES.map(([name, title]) => h("option", { value: name }, title)));
  const which = h("select", { "aria-label": "Panel", onchange: () => { only = Number(which.value); place(); } });
  const isLinked = h("input", { type: "checkbox", checked: true, onchange: () => { times.isOn = isLinked.checked; } });
  const hint = emptyState("⊞", "Add a panel to begin.");
  const stored = storedLayouts(context, () => layoutText(layout), (text) => { if (go(text)) remember(); }, error);
  view.append(h("div", { class: "column" }, toolbar({ title: "Overview" }, which, adder, h("label", {}, isLinked, "Link time axes"),
    h("span", { class: "spring" }), stored), error.element, hint, stage));

  let layout = null;
  let enlarged = null; // id of a leaf
  let only = null; // id of the leaf that is shown on a phone
  const panels = new Map(); // id to panel
  const board = {
    times, mayControl,
    change: (next, options) => { show(withLeaf(layout, next)); remember(options); },
    split(id, side) {
      if (isFull()) return;
      enlarged = null;
      show(beside(layout, id, side, leaf(panels.get(id).leaf.tab)));
      remember();
    },
    close(id) {
      if (enlarged === id) enlarged = null;
      show(without(layout, id));
      remember();
    },
    enlarge(id) {
      enlarged = enlarged === id ? null : id;
      place();
    },
    move(id, target, side) {
      show(moved(layout, id, target, side));
      remember();
    },
    step(id, side) {
      const near = neighbour(id, side);
      if (near !== null) board.move(id, near, "centre");
    },
    // Shows a place in the panel of its tab, if there is one: the requesting panel, or the first one.
    follow(from, tab, wanted) {
      const target = tabOf(from.tab) === tabOf(tab) ? from : leavesOf(layout).find((each) => each.tab === tab);
      if (!target) return false;
      board.change({ ...target, tab, argument: wanted });
      return true;
    },
  };

  function isFull() {
    const full = leavesOf(layout).length >= MAX_PANELS;
    error.show(full ? `There can be at most ${MAX_PANELS} panels.` : "");
    return full;
  }

  function add(added) {
    if (isFull()) return;
    enlarged = null;
    show(appended(layout, added, shape()));
    remember();
  }

  const shape = () => (stage.clientWidth || 16) / (stage.clientHeight || 9);

  function remember({ isReplacing = false } = {}) {
    const text = layoutText(layout);
    localStorage.setItem(LAYOUT, text);
    context.remember(text, { isReplacing });
  }

  // Creates, updates and closes panels so that there is one for each leaf.
  function show(next) {
    layout = next;
    const leaves = leavesOf(layout);
    const wanted = new Set(leaves.map(({ id }) => id));
    for (const [id, each] of panels) {
      if (wanted.has(id)) continue;
      each.close();
      panels.delete(id);
    }
    leaves.forEach((each) => {
      if (!panels.has(each.id)) panels.set(each.id, panel(each, TITLES, board));
      panels.get(each.id).show(each);
    });
    place();
  }

  const borders = [];
  function place() {
    const places = placesOf(layout);
    const alone = enlarged ?? onPhone(places.panels);
    hint.hidden = layout !== null;
    for (const border of borders.splice(0)) border.remove();
    let last = null; // in reading order, for the keyboard; only panels out of order move, because moving loses scroll positions
    for (const { leaf: own, box } of places.panels) {
      const { element, setEnlarged, setShown } = panels.get(own.id);
      element.dataset.id = own.id;
      position(element, box);
      setEnlarged(own.id === alone);
      element.hidden = alone !== null && own.id !== alone;
      setShown(!element.hidden && context.isShown);
      const after = last ? last.nextElementSibling : stage.firstElementChild;
      if (after !== element) stage.insertBefore(element, after);
      last = element;
    }
    if (alone === null) borders.push(...places.borders.map(borderElement));
    stage.append(...borders);
  }

  // Offers the panels, of which a phone shows one at a time. Returns the id of that one; null in a wide window.
  function onPhone(all) {
    which.hidden = !phone.matches || all.length < 2;
    if (which.hidden) return null;
    if (!all.some(({ leaf: own }) => own.id === only)) only = all[0].leaf.id;
    replace(which, all.map(({ leaf: { id, tab } }, index) => h("option", { value: id, selected: id === only },
      `${index + 1} of ${all.length}: ${TITLES.find(([name]) => name === tab)[1]}`)));
    return only;
  }
  phone.addEventListener("change", () => layout && place(), { signal: context.signal });

  function position(element, { x, y, w, h: height }) {
    Object.assign(element.style, { left: `${x}%`, top: `${y}%`, width: `${w}%`, height: `${height}%` });
  }

  function borderElement({ path, index, direction, box, share, size }) {
    const isRow = direction === "row";
    const move = (percent) => { layout = resized(layout, path, index, percent); };
    const border = h("div", { class: `border ${direction}`, role: "separator", tabindex: 0, "data-at": [...path, index].join("."),
      "aria-label": "Border between panels", "aria-orientation": isRow ? "vertical" : "horizontal", "aria-valuemin": 0,
        "aria-valuemax": 100, "aria-valuenow": Math.round(size), onkeydown: (event) => {
      const sign = { [isRow ? "ArrowLeft" : "ArrowUp"]: -1, [isRow ? "ArrowRight" : "ArrowDown"]: 1 }[event.key];
      if (!sign) return;
      event.preventDefault();
      move(sign * STEP);
      place();
      remember({ isReplacing: true });
      stage.querySelector(`.border[data-at="${border.dataset.at}"]`)?.focus();
    } });
    position(border, box);
    border.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      border.setPointerCapture(event.pointerId);
      let at = isRow ? event.clientX : event.clientY;
      const drag = (moving) => {
        const now = isRow ? moving.clientX : moving.clientY;
        move(((now - at) / (isRow ? stage.clientWidth : stage.clientHeight)) * 100 * (100 / share));
        at = now;
        const places = placesOf(layout);
        for (const { leaf: own, box: next } of places.panels) position(panels.get(own.id).element, next);
        places.borders.forEach((each, number) => position(borders[number], each.box));
      };
      border.addEventListener("pointermove", drag);
      border.addEventListener("lostpointercapture", () => {
        border.removeEventListener("pointermove", drag);
        remember();
      }, { once: true });
    });
    return border;
  }

  // The id of the neighbour of a panel on one side: the panel with the nearest centre there.
  function neighbour(id, side) {
    const all = placesOf(layout).panels.map(({ leaf: own, box }) => ({ id: own.id, x: box.x + box.w / 2, y: box.y + box.h / 2 }));
    const own = all.find((each) => each.id === id);
    const [dx, dy] = { left: [-1, 0], right: [1, 0], above: [0, -1], below: [0, 1] }[side];
    const distance = (each) => Math.hypot(each.x - own.x, each.y - own.y);
    const ahead = all.filter((each) => (each.x - own.x) * dx + (each.y - own.y) * dy > 1);
    return ahead.sort((one, other) => distance(one) - distance(other))[0]?.id ?? null;
  }

  // Shows the layout of an address, reusing open panels of the same tabs. "+view" adds a view to the layout.
  // Returns whether the text is a layout.
  function go(text) {
    try {
      if (text.startsWith("+")) {
        const added = parsedLayout(text.slice(1), NAMES);
        if (!layout) show(parsedLayout(localStorage.getItem(LAYOUT) ?? "", NAMES));
        if (added && !isFull()) show(appended(layout, added, shape()));
        remember({ isReplacing: true });
        return true;
      }
      const next = parsedLayout(text, NAMES);
      const free = [...panels.values()].map((each) => each.leaf);
      for (const isSame of [(one, other) => one.argument === other.argument, () => true]) {
        for (const each of leavesOf(next)) {
          if (panels.has(each.id)) continue;
          const found = free.findIndex((old) => old.tab === each.tab && isSame(old, each));
          if (found >= 0) [each.id] = free.splice(found, 1).map(({ id }) => id);
        }
      }
      enlarged = null;
      show(next);
      error.show();
      return true;
    } catch (problem) {
      error.show(problem.message);
      return false;
    }
  }

  context.onShown = (isShown) => { for (const each of panels.values()) each.setShown(isShown && !each.element.hidden); };
  if (argument) go(argument);
  else if (go(localStorage.getItem(LAYOUT) || FIRST)) remember({ isReplacing: true });
  return { go: (text) => text && go(text) };
}
