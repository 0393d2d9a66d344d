// The log of the system: 100,000 entries, of which only the visible ones are in the document. The address contains the node whose
// logger levels are shown, and the filters: /talker;levels=8,16;text=stuck.

import { playback } from "../bags/playback.js";
import { rulesPanel } from "../console_rules.js";
import { download, h, panelHead, problemLine, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { asLines, fromLines } from "../log_file.js";
import { LogGroups } from "../log_groups.js";
import { loggerLevels } from "../logger_levels.js";
import { placeOf } from "../place.js";
import { textFilter } from "../text_filter.js";
import { toolbar } from "../toolbar.js";

const KEPT = 100000;
const phone = matchMedia("(max-width: 700px)");
const rowHeight = () => (phone.matches ? 40 : 22); // as in page.css: on a phone, an entry has two lines
const OPTION = /;(?=(?:levels|text|node|place)=)/; // what separates options in the address
const HELP = "A part of the text; -part excludes; /regular expression/";
const LEVELS = [[1, "Debug"], [2, "Info"], [4, "Warn"], [8, "Error"], [16, "Fatal"]];
const [LEVEL, NODE, TEXT, STAMP, FILE, LINE, FUNCTION] = [0, 1, 2, 3, 4, 5, 6];

export function open(view, argument, context) {
  let entries = [];
  let shown = [];
  const groups = new LogGroups(); // of the entries in `shown`
  let lost = 0;
  let shownProblem = "";
  let selected = null; // the selected group
  let isPaused = false;
  let waiting = [];
  const levels = new Set(LEVELS.map(([level]) => level));
  const boxes = new Map(LEVELS.map(([level]) => [level, h("input", { type: "checkbox", checked: true,
    onchange: (event) => { if (event.target.checked) levels.add(level); else levels.delete(level); refine(); } })]));
  const text = h("input", { type: "search", placeholder: "Text", title: HELP, "aria-label": "Filter by text", "aria-keyshortcuts": "/",
    oninput: () => refine() });
  const node = h("input", { type: "search", placeholder: "Node", title: HELP, "aria-label": "Filter by node", oninput: () => refine() });
  const place = h("input", { type: "search", placeholder: "File or function", title: HELP, "aria-label": "Filter by place", size: 14,
    oninput: () => refine() });
  const filters = { text, node, place };
  const fold = h("input", { type: "checkbox", checked: true, onchange: () => { groups.isFolding = fold.checked; filter(); } });
  const pause = h("button", { "aria-pressed": "false", onclick: () => setPaused(!isPaused) }, "Pause");
  const file = h("input", { type: "file", hidden: true, "aria-label": "Log file", accept: ".jsonl", onchange: () => load() });

  function setPaused(isWanted) {
    isPaused = isWanted;
    pause.setAttribute("aria-pressed", String(isPaused));
    replace(pause, isPaused ? "Resume" : "Pause");
    if (!isPaused) take(waiting.splice(0));
  }

  // Shows the entries of a saved file. New entries wait until the user resumes.
  async function load() {
    try {
      const loaded = fromLines(await file.files[0].text());
      setPaused(true);
      entries = loaded.slice(-KEPT);
      lost = 0;
      filter();
      error.show();
    } catch (problem) {
      error.show(`${file.files[0].name} cannot be loaded: ${problem.message}`);
    }
    file.value = "";
  }

  const count = h("span", { class: "count pale" });
  const error = problemLine();
  const none = emptyState("≡");
  const space = h("div", { class: "space" });
  const rows = h("div", { class: "rows", role: "log", "aria-live": "off" });
  const scroll = h("div", { class: "scroll log", tabindex: 0, role: "group", "aria-label": "Entries; up and down choose one",
    onscroll: () => drawRows(), onkeydown: (event) => onKey(event) }, space, rows);
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Entry" });
  view.append(h("div", { class: "column" }, toolbar({ title: "Console" },
      LEVELS.map(([level, name]) => h("label", { class: `level-${level}` }, boxes.get(level), name)), text, node,
      h("label", { title: "Show consecutive equal entries as one row" }, fold, "Fold"),
        h("button", { title: "Go to the next error (e)", onclick: () => toNextError() }, "Next error"),
          h("span", { class: "spring" }), count, pause,
      h("button", { onclick: () => { entries = []; lost = 0; filter(); } }, "Clear"), place,
        h("button", { title: "Save the entries that pass the filters",
          onclick: () => download("log.jsonl", asLines(shown), "application/jsonl") }, "Save"),
            h("button", { title: "Show the entries of a saved file", onclick: () => file.click() }, "Load"), file,
              h("button", { onclick: () => showRules() }, "Rules"), h("button", { onclick: () => showLoggers() }, "Logger levels")),
    error.element, none, scroll), side);

  const drawn = new WeakMap(); // group to its row, and the entry in it
  context.onSource(() => { entries = []; lost = 0; filter(); });

  let [isText, isNode, isPlace] = [text, node, place].map((input) => textFilter(input.value));
  const matches = (entry) => levels.has(entry[LEVEL]) && isNode(entry[NODE]) && isText(entry[TEXT])
    && isPlace(`${entry[FILE]} ${entry[FUNCTION]}`);

  function take(fresh) {
    entries.push(...fresh);
    const matching = fresh.filter(matches);
    shown.push(...matching);
    groups.add(matching);
    if (entries.length > KEPT * 1.1) {
      entries = entries.slice(-KEPT);
      shown = entries.filter(matches);
      groups.set(shown);
    }
    const isAtEnd = scroll.scrollTop + scroll.clientHeight >= scroll.scrollHeight - rowHeight() * 2;
    draw();
    if (isAtEnd) scroll.scrollTop = scroll.scrollHeight;
  }

  // Applies the user's filters, and puts them into the address.
  function refine() {
    context.remember(rulesText(), { isReplacing: true });
    filter();
  }

  // The filters as they are in an address.
  function rulesText() {
    const chosen = levels.size === LEVELS.length ? []
      : [`levels=${LEVELS.flatMap(([level]) => (levels.has(level) ? [level] : [])).join(",")}`];
    const typed = Object.entries(filters).filter(([, input]) => input.value).map(([name, input]) => `${name}=${input.value}`);
    return ["", ...chosen, ...typed].join(";");
  }

  // Shows what an address says.
  function go(wanted) {
    const [ofNode, ...options] = wanted.split(OPTION);
    const given = Object.fromEntries(options.map((each) => [each.slice(0, each.indexOf("=")), each.slice(each.indexOf("=") + 1)]));
    for (const [name, input] of Object.entries(filters)) input.value = given[name] ?? "";
    for (const [level, box] of boxes) {
      box.checked = !("levels" in given) || given.levels.split(",").includes(String(level));
      if (box.checked) levels.add(level);
      else levels.delete(level);
    }
    filter();
    if (ofNode) showLoggers(ofNode);
  }

  function filter() {
    [isText, isNode, isPlace] = [text, node, place].map((input) => textFilter(input.value));
    shown = entries.filter(matches);
    groups.set(shown);
    if (selected) selected = groups.all.find(({ first, entry }) => selected.entry === entry || selected.first === first) ?? null;
    draw();
    scroll.scrollTop = scroll.scrollHeight;
  }

  function draw() {
    none.hidden = shown.length > 0;
    replace(none, entries.length ? `None of the ${entries.length} entries passes the filters.` : "There are no entries in the log.");
    space.style.height = `${groups.all.length * rowHeight()}px`;
    replace(count, `${shown.length} of ${entries.length}${lost ? `, ${lost} lost` : ""}`);
    drawRows();
  }

  function drawRows() {
    const first = Math.max(0, Math.floor(scroll.scrollTop / rowHeight()) - 5);
    const { all } = groups;
    const last = Math.min(all.length, first + Math.ceil(scroll.clientHeight / rowHeight()) + 10);
    rows.style.transform = `translateY(${first * rowHeight()}px)`;
    const wanted = all.slice(first, last).map(rowOf);
    for (const row of [...rows.children]) if (!wanted.includes(row)) row.remove();
    wanted.forEach((row, index) => row.classList.toggle("again", all[first + index].entry[NODE] === all[first + index - 1]?.entry[NODE]));
    wanted.forEach((row, index) => { if (rows.children[index] !== row) rows.insertBefore(row, rows.children[index] ?? null); });
  }

  // Reuses the row of a group, so that selected text stays selected.
  function rowOf(group) {
    const { entry, count: times } = group;
    const known = drawn.get(group);
    const row = known?.row ?? h("div", { class: `entry level-${entry[LEVEL]}`,
      onclick: () => { if (getSelection()?.isCollapsed) showEntry(group); } }, h("span", { class: "when" }),
        h("span", { class: "kind" }, levelName(entry[LEVEL])), h("span", { class: "node" }, entry[NODE]), h("span", { class: "times" }),
          h("span", { class: "text mono" }));
    if (known?.entry !== entry) {
      const [when, , , counted, said] = row.children;
      when.textContent = time(entry[STAMP]);
      counted.textContent = times > 1 ? `×${times}` : "";
      said.textContent = entry[TEXT].replaceAll("\n", " ⏎ ");
      drawn.set(group, { row, entry });
    }
    row.classList.toggle("selected", group === selected);
    return row;
  }

  function onKey(event) {
    if (event.key === "Escape" && selected) { closeEntry(); return; }
    if (event.key === "e") { toNextError(); return; }
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step || !groups.all.length) return;
    event.preventDefault();
    const at = selected ? groups.all.indexOf(selected) + step : Math.floor((scroll.scrollTop + scroll.clientHeight) / rowHeight()) - 1;
    goTo(Math.min(groups.all.length - 1, Math.max(0, at)));
  }

  function goTo(index) {
    scroll.scrollTop = Math.min(index * rowHeight(), Math.max(scroll.scrollTop, (index + 1) * rowHeight() - scroll.clientHeight));
    showEntry(groups.all[index]);
  }

  function toNextError() {
    const next = groups.nextError(selected ? groups.all.indexOf(selected) : -1);
    if (next >= 0) goTo(next);
    else replace(count, "no errors");
  }

  function closeEntry() {
    selected = null;
    side.hidden = true;
    drawRows();
  }

  function showEntry(group) {
    selected = group;
    const { entry } = group;
    side.hidden = false;
    drawRows();
    replace(side, panelHead(entry[NODE], () => closeEntry()),
      h("dl", {}, Object.entries({ Level: levelName(entry[LEVEL]), Time: `${time(entry[STAMP])} (${entry[STAMP]})`,
        Place: entry[FILE] ? `${entry[FILE]}:${entry[LINE]}` : "–", Function: entry[FUNCTION] || "–" }).map(([key, value]) =>
          [h("dt", {}, key), h("dd", {}, value)])),
      group.count > 1 ? h("p", { class: "key" }, `The newest of ${group.count} entries since ${time(group.first[STAMP])}. Without Fold, ` +
        "each has a row.") : null,
      h("p", { class: "moment" }, momentLinks(entry[STAMP])),
      h("h3", {}, "Text"), h("pre", { class: "mono whole" }, entry[TEXT]));
  }

  // Links to the moment of an entry: a plot shows the samples around it, and all views can go there if it is in the bag or the past.
  function momentLinks(stamp) {
    const isPlayed = playback.canShow(stamp);
    const jump = () => { if (playback.canShow(stamp)) playback.jump(stamp); };
    const plot = h("a", { href: placeOf("plot", `at:${stamp}`), onclick: () => { if (playback.bag) jump(); } }, "Plot");
    return ["This moment in ", plot, isPlayed ? [", ", h("a", { href: placeOf("scene"), onclick: jump }, "Scene"), ", ",
      h("button", { class: "plain link", onclick: jump }, "all views")] : null];
  }

  function showRules() {
    closeEntry();
    side.hidden = false;
    rulesPanel(side, context, rulesText, (wanted) => { go(wanted); refine(); }, () => { side.hidden = true; });
  }

  function showLoggers(ofNode = "") {
    side.hidden = false;
    const nodes = [...new Set(entries.map((entry) => entry[NODE]))];
    loggerLevels(side, context, nodes, ofNode, error, () => { side.hidden = true; });
  }

  context.watch("console", {}, (data) => {
    lost += data.lost;
    if (data.error !== shownProblem) error.show(shownProblem = data.error);
    if (data.history && !entries.length) take(data.history);
    if (isPaused) waiting = waiting.concat(data.entries).slice(-KEPT);
    else take(data.entries);
  }, error.show, { always: true });
  phone.addEventListener("change", () => draw(), { signal: context.signal });
  new ResizeObserver(() => drawRows()).observe(scroll);
  if (argument) go(argument);
  return { go };
}

const levelName = (level) => LEVELS.find(([number]) => number === level)?.[1] ?? String(level);
const clock = new Intl.DateTimeFormat("en-GB", { hour: "2-digit", minute: "2-digit", second: "2-digit", fractionalSecondDigits: 3 });
const EARLIEST_WALL_S = 1e8; // simulated time usually begins at 0
const time = (stamp) => (stamp < EARLIEST_WALL_S ? `${stamp.toFixed(3)} s` : clock.format(stamp * 1000));
