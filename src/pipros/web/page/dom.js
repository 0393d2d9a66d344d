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

export function replace(element, ...children) {
  element.replaceChildren(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
}

// Replaces the content of an element with that of another one, except for equal parts, so that a selection, the
// focus and open details are kept. Only for content without its own listeners.
export function morph(old, fresh) {
  if (old.nodeType !== fresh.nodeType || old.nodeName !== fresh.nodeName || old.childNodes.length !== fresh.childNodes.length) {
    old.replaceWith(fresh);
    return;
  }
  if (old.nodeType === Node.TEXT_NODE) {
    if (old.data !== fresh.data) old.data = fresh.data;
    return;
  }
  if (old.getAttribute("href") !== fresh.getAttribute("href") || old.className !== fresh.className) {
    old.replaceWith(fresh);
    return;
  }
  const [before, after] = [[...old.childNodes], [...fresh.childNodes]];
  before.forEach((child, index) => morph(child, after[index]));
}

// A table of at most `most` rows. Further rows are only counted, because they would slow down the browser.
export function limited(items, most, draw, columns) {
  const rows = items.slice(0, most).map(draw);
  if (items.length > most) rows.push(h("tr", {}, h("td", { colspan: columns, class: "note" }, `${items.length - most} more: filter to see them.`)));
  return rows;
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

export function download(name, content, type) {
  const link = h("a", { href: URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
