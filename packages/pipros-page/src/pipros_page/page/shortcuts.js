// The keys of the page. A control declares its key with aria-keyshortcuts. The key presses the first control with it that is visible
// in the panel, the pop-up or the view of the focused element, or else in the head or the time bar; a control that cannot be pressed
// gets the focus.
//
// Further keys lead from part to part: down to the first entry of a list, right to the controls beside it, and Escape out of a field.

import { h, replace } from "./dom.js";
import { unfold } from "./toolbar.js";

const FIELDS = "input:not([type=checkbox], [type=radio], [type=range], [type=button]), select, textarea";
const PRESSED = "button, a, input[type=checkbox]";
const FIRST = ["tbody tr[tabindex='0']", ".scroll.log", ".servers button", ".choice a, .choice button", ".vertex"];
const BESIDE = ["aside, .settings"];
const FIELD = ".bar :is(input, select), .form input";
const CONTROLS = "button:not([aria-label=Close]), input, textarea, select";
const OTHER_KEYS = [["/", "the search or first field of the view"], ["↓", "the first entry of a list"],
  ["→", "from an entry to the controls beside the list"], ["Escape", "out of a field, close what is selected"], ["?", "these keys"]];

const isVisible = (element) => element.checkVisibility({ visibilityProperty: true }) && !element.disabled;
// Whether a control is in a row of controls that is folded, or has no room for it.
const isFolded = (element) => element.closest(".toolbar") !== null && !element.closest("[hidden]") && !element.disabled;
const isField = (target) => target instanceof Element && target.matches(FIELDS);
const isNowhere = (target) => target === document.body || target.id === "view";

// Returns the name of a pressed key, as in aria-keyshortcuts.
export function keyName({ key, ctrlKey, metaKey, altKey, shiftKey }) {
  const parts = [ctrlKey || metaKey ? "Control" : "", altKey ? "Alt" : "", shiftKey && key.length > 1 ? "Shift" : ""];
  return [...parts.filter(Boolean), key === " " ? "Space" : key].join("+");
}

// The parts of the page in which a key is looked for, from an element outwards.
function scopesOf(target) {
  const shown = document.querySelector("#view > .tab:not([hidden])");
  return [target.closest?.(".panel"), target.closest?.("[popover]"), shown, ...document.querySelectorAll("header, #time")].filter(Boolean);
}

// Returns the first visible element that matches one of the selectors, of which the first ones are preferred.
function found(scopes, selectors) {
  for (const scope of scopes) {
    for (const selector of selectors) {
      const all = [...scope.querySelectorAll(selector)];
      const element = all.find(isVisible) ?? all.find(isFolded);
      if (element) return element;
    }
  }
  return null;
}

function press(control) {
  const menu = control.closest("[popover]");
  if (menu) menu.togglePopover(true);
  else if (!isVisible(control)) unfold(control.closest(".toolbar"), true);
  if (control.popoverTargetElement) control.popoverTargetElement.showPopover();
  else if (control.matches(PRESSED)) control.click();
  else {
    control.focus();
    if (control.matches("input")) control.select();
  }
}

// Returns the element to which an arrow key leads from part to part, or null.
function goalOf(name, target) {
  const scopes = scopesOf(target);
  if (name === "ArrowDown" && (isNowhere(target) || target.matches("[role=tab], input[type=search]"))) return found(scopes, FIRST);
  if (name === "ArrowRight" && (isNowhere(target) || target.matches(FIRST.join()))) {
    const beside = found(scopes, BESIDE);
    return beside && (found([beside], [CONTROLS]) ?? beside);
  }
  return null;
}

function controlOf(name, target) {
  const declared = `[aria-keyshortcuts~=${JSON.stringify(name)}]`;
  const isMenu = name === "v"; // its button is hidden while all tabs fit
  if (isMenu) return document.querySelector(declared);
  return found(scopesOf(target), name === "/" ? [declared, "input[type=search]", FIELD] : [declared]);
}

function onKey(event) {
  const { target } = event;
  if (event.defaultPrevented || event.isComposing || !(target instanceof Element)) return;
  const name = keyName(event);
  if (name === "Escape" && isField(target) && !target.closest("[popover]")) {
    if (target instanceof HTMLElement) target.blur();
    return;
  }
  const goal = goalOf(name, target);
  const control = goal || isMeant(event, target) ? null : controlOf(name, target);
  if (goal) goal.focus();
  else if (control) press(control);
  else if (name === "?" && !isField(target)) showKeys();
  else return;
  event.preventDefault();
}

// Whether a key belongs to the focused element: a letter to a field, and the space bar to a button.
const isMeant = ({ key, ctrlKey, metaKey }, target) => (isField(target) && !ctrlKey && !metaKey) || (key === " " && !isNowhere(target));

const list = h("dl", {});
const help = h("div", { id: "keys", popover: "auto", role: "dialog", "aria-label": "Keys", tabindex: -1 }, h("h2", {}, "Keys"), list);

// Shows the keys of all visible controls.
function showKeys() {
  const own = /** @type {HTMLElement[]} */ ([...document.querySelectorAll("[aria-keyshortcuts], [data-keys]")]);
  const isOffered = (each) => isVisible(each) || each.matches("#all-views, .tab:not([hidden]) [popover] *");
  const rows = own.filter(isOffered).map((each) => each.dataset.keys?.split(": ") ??
    [each.getAttribute("aria-keyshortcuts"), each.getAttribute("aria-label") || each.textContent || each.closest("label")?.textContent]);
  const texts = new Map([...OTHER_KEYS, ...rows].map(([key, text]) => [key, text])); // each key once
  replace(list, [...texts].map(([key, text]) => [h("dt", {}, h("kbd", {}, key)), h("dd", {}, text)]));
  help.showPopover();
  help.focus();
}

// Begins to listen, and returns the button that leads to the view past the head.
export function shortcuts() {
  document.body.append(help);
  document.addEventListener("keydown", onKey);
  return h("button", { class: "skip", onclick: () => document.getElementById("view").focus() }, "To the view");
}
