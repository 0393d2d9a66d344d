// Creates elements without parsing HTML, so that data from the system are only ever shown as text.

const SVG = "http://www.w3.org/2000/svg";

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "class") element.setAttribute("class", value);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return element;
}

export const h = (name, attributes, ...children) => fill(document.createElement(name), attributes, children);
export const s = (name, attributes, ...children) => fill(document.createElementNS(SVG, name), attributes, children);

// An id that no other element has: a view can be shown several times.
let lastId = 0;
export const uniqueId = (prefix) => `${prefix}-${lastId += 1}`;

export function replace(element, ...children) {
  element.replaceChildren(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
}

// Makes an element equal to a fresh one, and leaves equal parts unchanged, so that selected text, the focus and open
// details survive. Only for content without its own listeners. Children with the same `data-key` are the same, wherever
// they are; others are compared in their order.
export function morph(old, fresh) {
  if (old.nodeType !== fresh.nodeType || old.nodeName !== fresh.nodeName) {
    old.replaceWith(fresh);
    return;
  }
  if (old.nodeType === Node.TEXT_NODE) {
    if (old.data !== fresh.data) old.data = fresh.data;
    return;
  }
  morphAttributes(old, fresh);
  morphChildren(old, [...fresh.childNodes]);
}

function morphAttributes(old, fresh) {
  for (const { name } of [...old.attributes]) if (!fresh.hasAttribute(name) && name !== "open") old.removeAttribute(name);
  for (const { name, value } of fresh.attributes) if (old.getAttribute(name) !== value && name !== "open") old.setAttribute(name, value);
}

function morphChildren(old, after) {
  const known = keyedChildren(old, new Set(after.map(keyOf)));
  let next = old.firstChild;
  for (const child of after) {
    const key = keyOf(child);
    const same = key ? known.get(key) : next && !keyOf(next) ? next : null;
    known.delete(key); // further children with the same key are new elements
    if (!same) {
      old.insertBefore(child, next);
      continue;
    }
    if (same === next) next = next.nextSibling;
    else old.insertBefore(same, next);
    morph(same, child);
  }
  while (next) {
    const rest = next;
    next = next.nextSibling;
    rest.remove();
  }
}

// Returns the children by their keys, and removes those whose keys are not in `kept` or occur again.
function keyedChildren(element, kept) {
  const known = new Map();
  for (const child of [...element.childNodes]) {
    const key = keyOf(child);
    if (key && (!kept.has(key) || known.has(key))) child.remove();
    else if (key) known.set(key, child);
  }
  return known;
}

const keyOf = (node) => (node instanceof Element ? node.getAttribute("data-key") : null);

export const panelHead = (title, onClose) => h("div", { class: "panel-head" }, h("h2", {}, title),
  h("button", { class: "plain", "aria-label": "Close", title: "Close (Escape)", onclick: onClose }, "×"));

// Returns the line of a view that says what went wrong: {element, show, attempt}. `show(text)` shows a problem, or none. `attempt(work)`
// shows why the promise of `work()` is rejected, or nothing if it is kept; its own promise says whether it is.
export function problemLine(tag = "div") {
  const element = h(tag, { class: "error", role: "alert" });
  const show = (text = "") => replace(element, text);
  async function attempt(work) {
    try {
      await work();
      show();
      return true;
    } catch (problem) {
      show(problem.message);
      return false;
    }
  }
  return { element, show, attempt };
}

// Formatting ---------------------------------------------------------------------------------------------------------

export function hertz(rate) {
  if (rate === null || rate === undefined) return "–";
  return `${rate >= 100 ? rate.toFixed(0) : rate >= 10 ? rate.toFixed(1) : rate.toFixed(2)} Hz`;
}

export function bytes(size) {
  if (size === null || size === undefined) return "–";
  const units = ["B", "kB", "MB", "GB"];
  let unit = 0;
  while (size >= 1000 && unit < units.length - 1) {
    size /= 1000;
    unit += 1;
  }
  return `${unit === 0 ? Math.round(size) : size.toFixed(size < 10 ? 2 : 1)} ${units[unit]}`;
}

export const bandwidth = (size) => (size === null || size === undefined ? "–" : `${bytes(size)}/s`);

const clock = new Intl.DateTimeFormat("en-GB", { timeStyle: "medium" });

// The time of day of a time in seconds since 1970.
export const timeOfDay = (seconds) => clock.format(seconds * 1000);

export const milliseconds = (seconds) => (seconds === null || seconds === undefined ? "–"
  : `${(seconds * 1000).toFixed(seconds < 0.01 ? 1 : 0)} ms`);

export function download(name, content, type) {
  const link = h("a", { href: URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
