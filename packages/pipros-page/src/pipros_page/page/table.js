// A table whose rows are updated in place, so that selected text, the focus and the position survive updates.

import { download, h, morph, replace } from "./dom.js";

// Columns: {title, text, kind, order}. `text(row)` returns a string or an element; `kind` is the class of its cells (name,
// number, long, mono); `order(row)` returns the value by which the column is sorted; without it, the column cannot be sorted.
// `options`: `label`; `keyOf(row)`; `onChoose(key)` if rows can be chosen;
// `onSort()` instead of sorting; `most` rows are shown; `sortBy`: a title.
export function dataTable(columns, options) {
  const { label, keyOf, onChoose = null, onSort = null, most = Infinity, sortBy = "" } = options;
  let sorted = { title: sortBy, isDown: false };
  let rows = [];
  let chosen = null;
  const shown = new Map(); // key to {element, cells}
  const heads = new Map(columns.map((column) => [column.title, head(column)]));
  const body = h("tbody", {});
  const keepTabStop = onChoose ? reachByKeys(body, onChoose) : () => {};
  const more = h("tr", { class: "more" }, h("td", { colspan: columns.length, class: "note" }));
  const element = h("table", { role: onChoose ? "grid" : null, "aria-label": label },
    h("thead", {}, h("tr", {}, [...heads.values()])), body);

  function head({ title, kind = "", order }) {
    const content = order ? h("button", { class: "plain", onclick: () => sort(title) }, title) : title;
    return h("th", { class: kind }, content);
  }

  function sort(title) {
    sorted = { title, isDown: sorted.title === title && !sorted.isDown };
    if (onSort) onSort();
    else show(rows);
  }

  // With `isOrdered` the rows keep their order, whatever the table is sorted by.
  function show(next, { isOrdered = false } = {}) {
    rows = next;
    const wanted = (isOrdered ? rows : inOrder(rows)).slice(0, most);
    const keys = new Set(wanted.map(keyOf));
    for (const [key, { element: old }] of shown) {
      if (keys.has(key)) continue;
      old.remove();
      shown.delete(key);
    }
    const focused = body.contains(document.activeElement) ? document.activeElement : null;
    wanted.forEach((row, index) => place(body, update(row), index));
    if (focused instanceof HTMLElement && focused !== document.activeElement) focused.focus({ preventScroll: true }); // its row was moved
    keepTabStop();
    replace(more.firstChild, `${rows.length - wanted.length} more: filter to see them.`);
    if (rows.length > wanted.length) body.append(more);
    else more.remove();
    for (const [title, cell] of heads) {
      cell.setAttribute("aria-sort", title !== sorted.title ? "none" : sorted.isDown ? "descending" : "ascending");
    }
  }

  const inOrder = (list) => ordered(list, columns.find(({ title }) => title === sorted.title)?.order, sorted.isDown);

  function update(row) {
    const key = keyOf(row);
    const known = shown.get(key) ?? create(key);
    columns.forEach(({ text }, index) => fill(known.cells[index], text(row)));
    return known.element;
  }

  function create(key) {
    const cells = columns.map(({ kind = "name" }) => h("td", { class: kind }));
    const choosing = onChoose ? { tabindex: -1, "aria-selected": String(key === chosen), onclick: () => choose(key) } : {};
    const made = { element: h("tr", { "data-name": key, ...choosing }, cells), cells };
    shown.set(key, made);
    return made;
  }

  function choose(key) {
    if (!getSelection()?.isCollapsed) return; // the user is selecting text
    onChoose(key);
  }

  function mark(key) {
    chosen = key;
    const row = shown.get(key)?.element;
    if (row && body.contains(document.activeElement) && !row.contains(document.activeElement)) row.focus({ preventScroll: true });
    for (const [other, made] of shown) made.element.setAttribute("aria-selected", String(other === key));
  }

  element.addEventListener("copy", copyRow);
  const csvButton = (name) => h("button", { title: "Save the table as CSV",
    onclick: () => download(`${name}.csv`, csv(columns, inOrder(rows)), "text/csv") }, "CSV");
  return { element, show, mark, csvButton };
}

// The order of a column that begins with the largest value, and ends with rows that have none.
export const largestFirst = (value) => -(value ?? -1);

// Returns the rows sorted by the value that `order` returns for a row; without it, as they are.
function ordered(rows, order, isDown) {
  if (!order) return rows;
  const sign = isDown ? -1 : 1;
  return [...rows].sort((one, other) => sign * compared(order(one), order(other)));
}

function place(body, row, index) {
  if (body.children[index] !== row) body.insertBefore(row, body.children[index] ?? null);
}

// Makes rows reachable by keys: Tab stops at the first one until a row has had the focus. Returns what to call after a change.
function reachByKeys(body, onChoose) {
  let isEntered = false;
  body.addEventListener("focusin", (event) => {
    isEntered = true;
    stopAt(body, event.target);
  });
  body.addEventListener("keydown", (event) => chooseByKey(event, onChoose));
  return () => {
    if (isEntered && body.querySelector(":scope > [tabindex='0']")) return;
    stopAt(body, body.querySelector("[data-name]"));
  };
}

// Makes Tab stop at one row only: that of an element.
function stopAt(body, element) {
  for (const row of body.children) if (row.dataset.name) row.tabIndex = row.contains(element) ? 0 : -1;
}

// The arrow keys go from row to row, Enter and the space bar choose one.
function chooseByKey(event, onChoose) {
  const row = event.target.closest("tr");
  const next = { ArrowDown: row.nextElementSibling, ArrowUp: row.previousElementSibling }[event.key];
  if (next?.dataset.name) next.focus();
  else if (event.key === "Enter" || event.key === " ") onChoose(row.dataset.name);
  else return;
  event.preventDefault();
}

// Ctrl-C on a row without selected text copies the row, with tabs between its cells.
function copyRow(event) {
  const row = event.target instanceof Element ? event.target.closest("tr") : null;
  if (!row || !getSelection()?.isCollapsed) return;
  event.clipboardData.setData("text/plain", [...row.children].map((cell) => cell.textContent).join("\t"));
  event.preventDefault();
}

// Returns the rows as text for spreadsheets.
function csv(columns, rows) {
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  // Names and texts come from peers, and a spreadsheet would run them as formulas.
  const harmless = (text) => (/^[=+\-@\t\r]/.test(text) && Number.isNaN(Number(text)) ? `'${text}` : text);
  const plain = (content) => harmless(content instanceof Node ? content.textContent : String(content ?? ""));
  const saved = columns.filter(({ order }) => order); // not those of buttons
  const lines = [saved.map(({ title }) => title), ...rows.map((row) => saved.map(({ text }) => plain(text(row))))];
  return lines.map((line) => `${line.map(quoted).join(",")}\n`).join("");
}

function fill(cell, content) {
  if (content instanceof Node) {
    if (cell.firstChild) morph(cell.firstChild, content);
    else cell.append(content);
    return;
  }
  const text = String(content ?? "");
  if (cell.textContent === text && !cell.firstElementChild) return;
  cell.textContent = text;
  if (cell.classList.contains("name")) cell.title = text;
}

function compared(one, other) {
  if (typeof one === "number" && typeof other === "number") return one - other;
  if (one === null || one === undefined) return other === null || other === undefined ? 0 : -1;
  if (other === null || other === undefined) return 1;
  return String(one).localeCompare(String(other));
}
