// Bags: a timeline that plays a bag for all tabs. The address contains the name of the bag and the moment, in seconds
// from its beginning, at which it is paused: run.bag@14.5.

import { playback, elapsed } from "../bags/playback.js";
import { recordingPanel } from "../bags/recording.js";
import { timeline } from "../bags/timeline.js";
import { bytes, download, h, problemLine, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { placeOf } from "../place.js";
import { toolbar } from "../toolbar.js";

const MAX_LISTED = 100;
const ADDRESS_MS = 300;
const SHORTEST_S = 0.05; // shorter times count as 0 in the address
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];

export function open(view, argument, context) {
  const choice = h("select", { "aria-label": "Bag", onchange: () => choose(choice.value) });
  const figures = h("span", { class: "pale" });
  const error = problemLine();
  const hint = emptyState("▤");
  const list = h("div", { class: "note choice", role: "group", "aria-label": "Bags" });
  const progress = h("progress", { max: 1, "aria-label": "Reading the bag", hidden: true });
  const button = (text, title, onclick, key = null) => h("button", { "aria-label": title, title, "aria-keyshortcuts": key, onclick }, text);
  const play = button("▶", "Play", () => playback.control({ play: !playback.state?.playing }), "Space");
  const step = (direction) => playback.control({ step: direction, topics: tracks.topics() });
  const speed = h("select", { "aria-label": "Speed", onchange: () => playback.control({ speed: Number(speed.value) }) },
    SPEEDS.map((value) => h("option", { value, selected: value === 1 }, `${value}×`)));
  const loop = h("input", { type: "checkbox", "aria-keyshortcuts": "l", onchange: () => playback.control({ loop: loop.checked }) });
  const moment = h("output", { class: "mono", "aria-label": "Moment in the bag" });
  const goal = h("input", { size: 8, placeholder: "1:02.5", "aria-label": "Jump to", "aria-keyshortcuts": "/" });
  const controls = toolbar({ class: "transport", hidden: true },
    button("|◀", "To the beginning", () => jump(playback.bag.begin)), button("◂|", "Previous message", () => step(-1), ","), play,
      button("▸|", "Next message", () => step(1), "."),
    speed, h("label", {}, loop, "Loop"), moment,
    h("form", { onsubmit: (event) => { event.preventDefault(); jumpToText(goal.value); } }, goal, h("button", {}, "Jump")));
  const form = h("select", { "aria-label": "Format" }, [["bag", "Bag"], ["csv", "CSV"],
    ["images", "Images"]].map(([value, text]) => h("option", { value }, text)));
  const exported = h("button", { "aria-keyshortcuts": "x", title: "Save the checked topics: the part selected by a drag with Shift, or all",
    onclick: () => { if (selection || isSure) save(); else ask(true); } }, "Export");
  const cancel = h("button", { hidden: true, title: "End the export" }, "Cancel");
  const tracks = timeline({ jump: (time) => jump(time), toggle: () => play.click(), select: (range) => { selection = range; ask(false); },
    choose: () => {} });
  let selection = null; // [from, to]
  let isSure = false; // whether the user has confirmed that the whole bag is to be saved
  const closing = button("Close", "Close the bag", () => choose(""));
  controls.append(h("span", { class: "spring" }), form, exported, cancel);
  const recorder = recordingPanel(context, (name) => choose(name));
  view.append(h("div", { class: "column" },
    toolbar({ title: "Bags" }, choice, progress, figures, h("span", { class: "spring" }), closing),
    error.element, recorder, controls, hint, list, h("div", { class: "scroll" }, tracks.element)));
  tracks.element.hidden = true;
  let shown = null; // the bag whose tracks are shown
  let names = [];
  let folder = null;

  context.watch("bags", {}, (data) => {
    folder = data.folder;
    recorder.hidden = !folder; // later, it would move the timeline under the pointer
    if (names.join("\n") !== data.bags.map((bag) => bag.name).join("\n")) {
      names = data.bags.map((bag) => bag.name);
      replace(list, names.slice(0, MAX_LISTED).map((name) => h("a", { href: placeOf("bags", name) }, name)));
    }
    const options = [["", "Choose a bag"], ...data.bags.map((bag) => [bag.name, `${bag.name} (${bytes(bag.size)})`])];
    if (options.map(([, text]) => text).join("\n") !== [...choice.options].map((option) => option.textContent).join("\n")) {
      replace(choice, options.map(([name, text]) => h("option", { value: name }, text)));
      choice.value = playback.name;
    }
    show();
  }, error.show);

  // Without a selection, the first press asks and the second one saves, because a bag can be large.
  function ask(isAsked) {
    isSure = isAsked;
    const whole = isSure ? ` the whole bag (${bytes(playback.bag.size)})?` : "";
    const part = selection ? ` selection (${elapsed(selection[1] - selection[0])})` : whole;
    replace(exported, `Export${part}`);
  }

  // Saves the selected part, which arrives in pieces.
  function save() {
    const { bag } = playback;
    const [begin, end] = selection ?? [bag.begin, bag.end];
    const pieces = [];
    let size = 0;
    const showSize = () => replace(exported, `Exporting: ${bytes(size)}`);
    exported.disabled = true;
    cancel.hidden = false;
    showSize();
    const finish = (text) => {
      exported.disabled = false;
      cancel.hidden = true;
      ask(false);
      error.show(text);
      stop();
    };
    cancel.onclick = () => finish("");
    const stop = context.watch("bag_export", { name: bag.name, format: form.value, topics: tracks.topics(), begin, end }, (data) => {
      if (!data.done) {
        pieces.push(data);
        size += data.byteLength;
        showSize();
        return;
      }
      const name = bag.name.split("/").at(-1).replace(/\.(bag|mcap|bag\.active)$/, "");
      download(`${name}-part.${form.value === "bag" ? "bag" : "zip"}`, new Blob(pieces), "application/octet-stream");
      finish("");
    }, (problem) => problem && finish(problem), { always: true });
  }

  async function jump(time) {
    if (!playback.bag) return;
    wanted = time - playback.bag.begin;
    tracks.setMoment(time);
    await playback.jump(time);
    if (!playback.error) wanted = null;
  }

  function jumpToText(text) {
    const [seconds, minutes = "0"] = text.trim().split(":").reverse();
    const time = Number(minutes) * 60 + Number(seconds);
    if (text.trim() && Number.isFinite(time)) jump(playback.bag.begin + time);
  }

  function show() {
    const { bag, state, opening, name } = playback;
    error.show(playback.error || state?.error || "");
    progress.hidden = opening === null || !name;
    if (opening) progress.value = opening;
    else progress.removeAttribute("value");
    controls.hidden = tracks.element.hidden = !bag;
    hint.hidden = Boolean(bag);
    list.hidden = Boolean(name);
    closing.hidden = !name;
    replace(hint, hintText(name));
    choice.value = playback.isRewind ? "" : name;
    if (!bag) shown = null;
    if (!name && noted && !playback.error) forgetAddress(); // the bag was closed elsewhere
    if (bag && state) showBag(bag, state);
    else replace(figures);
  }

  function hintText(name) {
    if (folder === null) return "";
    if (folder === "") return "Start the command with --bags DIR to open the bags in a folder.";
    if (name) return "Reading the bag …";
    return names.length ? "While a bag is open, all tabs show its moment instead of the running system."
      : `There are no bags in ${folder}.`;
  }

  function showBag(bag, state) {
    if (shown !== bag) {
      shown = bag;
      tracks.show(bag);
      if (wanted !== null) jump(bag.begin + wanted);
      replace(figures, `${bytes(bag.size)}, ${elapsed(bag.end - bag.begin)}, from ` +
        `${new Date(bag.begin * 1000).toLocaleString("en-GB")}${bag.damage.length ? `; damaged: ${bag.damage[0]}` : ""}`);
    }
    tracks.setMoment(playback.moment);
    if (!playback.jumping && !state.playing && !bag.rewind) noteMoment(state.moment - bag.begin);
    moment.textContent = `${elapsed(state.moment - bag.begin)} / ${elapsed(bag.end - bag.begin)}`;
    speed.value = String(state.speed);
    loop.checked = state.loop;
    const action = state.playing ? "Pause" : "Play";
    if (play.title === action) return;
    play.setAttribute("aria-label", action);
    play.title = action;
    replace(play, state.playing ? "‖" : "▶");
  }

  playback.addEventListener("change", show, { signal: context.signal });
  let noted = ""; // the argument of the address
  let noting = 0;
  function noteMoment(seconds) {
    const text = seconds < SHORTEST_S ? playback.name : `${playback.name}@${seconds.toFixed(1)}`;
    if (text === noted) return;
    noted = text;
    clearTimeout(noting);
    noting = setTimeout(() => context.remember(noted, { isReplacing: true }), ADDRESS_MS); // browsers limit the number of changes
  }

  let wanted = null; // the last requested moment, in seconds from the beginning, until the bag is open

  function forgetAddress() {
    clearTimeout(noting);
    noted = "";
    context.remember("", { isReplacing: true });
  }

  // Opens a bag; without a name, closes the open one.
  function choose(name) {
    clearTimeout(noting);
    noted = name;
    wanted = null;
    context.remember(name);
    playback.open(name);
  }

  // Shows what an address says.
  function go(text) {
    const [, name, seconds] = /^(.*?)(?:@(\d+(?:\.\d+)?))?$/.exec(text);
    clearTimeout(noting);
    noted = text;
    wanted = seconds === undefined ? null : Number(seconds);
    if (playback.isRewind && !name) return; // the tab shows its tracks
    if (name !== playback.name) playback.open(name);
    else if (wanted !== null && playback.bag) jump(playback.bag.begin + wanted);
  }

  context.signal.addEventListener("abort", () => { clearTimeout(noting); tracks.close(); });
  if (argument) go(argument);
  show();
  return { go };
}
