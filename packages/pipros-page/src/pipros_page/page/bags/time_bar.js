// The timeline along the bottom of all tabs while they show a bag or the past, with marks for errors, diagnostics and
// notes; and the button in the head that goes back.

import { h, replace, uniqueId } from "../dom.js";
import { live } from "../live.js";
import { KINDS, Marks } from "./marks.js";
import { elapsed, playback } from "./playback.js";

const MAX_ROWS = 300;
const STEP_S = 10; // by which Page up and Page down move the moment

export function timeBar(element) {
  const marks = new Marks();
  const strip = h("div", { class: "marks", "aria-hidden": "true" });
  const slider = h("input", { type: "range", min: 0, step: "any", "aria-label": "Timeline",
    oninput: () => playback.jump(playback.bag.begin + Number(slider.value)), onkeydown: onKey });
  const track = h("div", { class: "track" }, strip, slider);
  const end = h("span", { class: "end mono pale" });
  const previous = goButton(marks, "◂", "Previous mark", "[", -1);
  const next = goButton(marks, "▸", "Next mark", "]", 1);
  const here = h("output", { class: "here", "aria-label": "Mark" });
  const note = noteForm(marks, () => draw());
  const list = markList(marks, note);
  const back = h("button", { class: "back", title: "Show the running system again (r)", "aria-keyshortcuts": "r",
    onclick: () => playback.open("") }, "Live");
  const error = h("span", { class: "error-text", role: "alert" });
  element.append(document.getElementById("shown-bag"), track, end, previous, next, list.button, note.button, back, here, error,
    list.element, note.form);
  let shown = null; // the bag whose marks are shown
  let stop = () => {};

  function follow(bag) {
    stop();
    marks.clear();
    shown = bag;
    if (!bag) return;
    slider.max = bag.end - bag.begin;
    stop = live.watch("bag_events", { name: playback.name }, (data) => {
      if (data.marks) marks.add(data.marks, data.lost);
      if (data.notes) marks.setNotes(data.notes);
      note.take(data);
      if (data.error) replace(error, data.error);
      draw();
    }, (problem) => replace(error, problem));
  }

  function draw() {
    drawStrip(strip, marks, shown);
    list.draw();
    showMoment();
  }

  function showMoment() {
    const { moment } = playback;
    if (moment === undefined) return;
    if (Number(slider.value) !== moment - shown.begin) slider.value = moment - shown.begin;
    const found = marks.at(moment);
    slider.setAttribute("aria-valuetext", [elapsed(moment - shown.begin), ...found.map(({ text }) => text)].join(", "));
    const text = found.map(({ kind, text: each }) => `${KINDS[kind][0]} ${each}`).join("  ");
    if (here.textContent !== text) replace(here, text);
    [previous.disabled, next.disabled] = [-1, 1].map((direction) => !marks.next(moment, direction));
  }

  function show() {
    const { bag } = playback;
    const isFailed = !bag && playback.isRewind && Boolean(playback.error);
    if (bag !== shown) {
      replace(error);
      follow(bag);
      if (bag) draw();
    }
    element.hidden = !bag && !isFailed;
    element.classList.toggle("failed", isFailed);
    if (isFailed) replace(error, playback.error);
    note.button.hidden = Boolean(bag?.rewind);
    if (!bag) return;
    replace(end, bag.rewind ? "now" : elapsed(bag.end - bag.begin));
    showMoment();
  }

  playback.addEventListener("change", show);
}

// Makes the button in the head go back in time. It is hidden while a bag is open, or if the server records nothing.
export function rewindButton(button) {
  const show = () => { button.hidden = Boolean(playback.bag) || !playback.span; };
  live.watch("rewind", {}, ({ span, seconds }) => {
    playback.span = seconds && span;
    playback.since = Date.now() / 1000 - seconds;
    button.title = `Hold all tabs, and look back at the last ${Math.round(seconds)} s (r)`;
    show();
  });
  button.addEventListener("click", () => playback.rewind());
  playback.addEventListener("change", show);
}

function onKey(event) {
  const shift = { PageUp: -STEP_S, PageDown: STEP_S }[event.key];
  if (event.key === " ") playback.control({ play: !playback.state?.playing });
  else if (shift) playback.jump(playback.moment + shift);
  else return;
  event.preventDefault();
}

function goButton(marks, text, label, key, direction) {
  return h("button", { "aria-label": label, title: `${label} (${key})`, "aria-keyshortcuts": key, onclick: () => {
    const mark = marks.next(playback.moment, direction);
    if (mark) playback.jump(mark.time);
  } }, text);
}

// Draws the marks at their places.
function drawStrip(strip, marks, { begin, end }) {
  replace(strip, marks.all.map(({ time, kind, text }) => {
    const mark = h("span", { class: `mark-${kind}`, title: `${elapsed(time - begin)} ${text}`, onclick: () => playback.jump(time) },
      KINDS[kind][0]);
    mark.style.left = `${(100 * (time - begin)) / (end - begin || 1)}%`;
    return mark;
  }));
}

// The list of all marks, and the button that opens it.
function markList(marks, note) {
  const element = h("div", { popover: "", id: uniqueId("marks"), class: "mark-list", role: "group", "aria-label": "Marks",
    onbeforetoggle: () => fill() });
  const button = h("button", { popovertarget: element.id, title: "List of errors, diagnostics and notes" });

  function row({ time, kind, text }) {
    const [sign, title] = KINDS[kind];
    const jump = h("button", { class: `plain mark-${kind}`, onclick: () => playback.jump(time) },
      h("span", { class: "mono" }, elapsed(time - playback.bag.begin)), ` ${sign} ${title}: ${text}`);
    const remove = kind !== "note" || !note.isAllowed ? null
      : h("button", { "aria-label": `Delete the note ${text}`, onclick: () => note.remove({ time, text }) }, "Delete");
    return h("p", {}, jump, remove);
  }

  function fill() {
    const more = Math.max(0, marks.all.length - MAX_ROWS) + marks.lost;
    const rows = marks.all.slice(0, MAX_ROWS).map(row);
    replace(element, rows.length ? rows : h("p", { class: "pale" }, "No errors, diagnostics or notes"),
      more ? h("p", { class: "pale" }, `and ${more} more`) : null);
  }

  function draw() {
    replace(button, marks.all.length === 1 ? "1 mark" : `${marks.all.length} marks`);
    if (element.matches(":popover-open")) fill();
  }

  return { element, button, draw };
}

// The form for a new note, and the button that opens it. `onChange` is called when the notes have changed.
function noteForm(marks, onChange) {
  const text = h("input", { size: 40, maxlength: 1000, required: true, placeholder: "what happens here", "aria-label": "Text of the note",
    autofocus: true });
  const problem = h("span", { class: "error-text", role: "alert" });
  const form = h("form", { popover: "", id: uniqueId("note"), class: "note-form", "aria-label": "Note", onsubmit: (event) => {
    event.preventDefault();
    act("add_note", { time: playback.moment, text: text.value.trim() });
  } }, text, h("button", {}, "Add note"), problem);
  const button = h("button", { popovertarget: form.id, "aria-keyshortcuts": "k",
    title: "Write a note about this moment (k), in a file beside the bag" }, "Note");
  const own = { form, button, isAllowed: false, take, remove: (note) => act("remove_note", note) };

  function take({ may_note: isAllowed, error }) {
    if (isAllowed === undefined) return;
    own.isAllowed = isAllowed;
    button.disabled = !isAllowed;
    replace(problem, error ?? "");
  }

  async function act(action, note) {
    try {
      marks.setNotes(await live.act(action, { name: playback.name, ...note }));
      replace(problem);
      text.value = "";
      form.hidePopover();
      onChange();
    } catch (failure) {
      replace(problem, failure.message);
      if (!form.matches(":popover-open")) form.showPopover();
    }
  }

  return own;
}
