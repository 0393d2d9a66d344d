// The topics of a bag as tracks on a timeline, with message density, thumbnails of images, the moment, and a selection.

import { h, replace } from "../dom.js";
import { elapsed } from "./playback.js";
import { lane, thumbnailsIn, trackName } from "./tracks.js";
import { VisibleTime } from "./visible_time.js";

const STEP = 0.01; // fraction of the visible time by which an arrow key moves the moment
const ZOOMS = { "+": 1 / 1.5, "=": 1 / 1.5, "-": 1.5, 0: Infinity };

// `on.jump(seconds)`, `on.toggle()`, `on.select([from, to] or null)` and `on.choose()` are called for the user's actions.
export function timeline(on) {
  const cursor = h("div", { class: "cursor" });
  const chosen = h("div", { class: "selection", hidden: true });
  const axis = h("div", { class: "axis" });
  const area = h("div", { class: "area", tabindex: 0, role: "slider", "aria-label": "Moment", "aria-keyshortcuts": "t", "aria-valuemin": 0,
    title: "Click or drag to jump; with Shift, select a part. Escape clears the selection. The wheel, + and - zoom; 0 shows the whole " +
      "bag.", onkeydown: (event) => onKey(event) }, chosen, cursor);
  const names = h("div", { class: "names" });
  const lanes = h("div", { class: "lanes" }, axis, area);
  const element = h("div", { class: "timeline" }, names, lanes);
  const thumbnails = thumbnailsIn(area);
  let bag = null;
  let time = new VisibleTime(0, 1);
  let moment = 0;
  let selection = null;

  // Draws what depends on the visible time, if that has changed.
  function draw(isChanged) {
    if (!isChanged) return;
    drawTimes(axis, area, time);
    place();
    thumbnails.draw(bag, time);
  }

  // Places the moment and the selection.
  function place() {
    cursor.style.left = time.percent(moment);
    if (selection) Object.assign(chosen.style, { left: time.percent(selection[0]), width: time.width(selection[1] - selection[0]) });
  }

  // Shows the tracks of a bag.
  function show(next) {
    bag = next;
    moment = bag.begin;
    time = new VisibleTime(bag.begin, bag.end);
    select(null);
    replace(names, h("div", { class: "axis" }), bag.tracks.map((track) => trackName(track, () => on.choose())));
    replace(area, bag.tracks.map(lane), chosen, cursor);
    area.setAttribute("aria-valuemax", time.duration.toFixed(1));
    draw(true);
  }

  function setMoment(next) {
    moment = next;
    draw(time.follow(moment));
    place();
    describe(area, moment - bag.begin);
  }

  function select(range) {
    selection = range;
    chosen.hidden = !range;
    place();
    on.select(range);
  }

  function onKey(event) {
    if (event.key === " ") { event.preventDefault(); on.toggle(); return; }
    if (event.key === "Escape") { select(null); return; }
    if (!bag) return;
    if (event.key in ZOOMS) { event.preventDefault(); draw(time.zoom(ZOOMS[event.key], moment)); return; }
    const to = momentAfter(event.key, moment, bag, STEP * time.span);
    if (to === null) return;
    event.preventDefault();
    if (event.shiftKey) select([Math.min(selection?.[0] ?? moment, to), Math.max(selection?.[0] ?? moment, to)]);
    on.jump(to);
  }

  listenToPointer(area, lanes, { get time() { return bag && time; }, draw, select, jump: on.jump });
  return {
    element, show, setMoment, select, topics: () => checkedTopics(names),
    close: () => thumbnails.close(),
  };
}

const checkedTopics = (names) => [...names.querySelectorAll("input")].filter((box) => box.checked).map((box) => box.dataset.topic);

function describe(area, seconds) {
  area.setAttribute("aria-valuenow", seconds.toFixed(1));
  area.setAttribute("aria-valuetext", elapsed(seconds));
}

// Draws the ticks, and places the densities and thumbnails.
function drawTimes(axis, area, time) {
  replace(axis, time.ticks().map((seconds) => {
    const tick = h("span", { class: "tick" }, elapsed(seconds));
    tick.style.left = time.percent(time.begin + seconds);
    return tick;
  }));
  for (const canvas of area.querySelectorAll(".density"))
    Object.assign(canvas.style, { left: time.percent(time.begin), width: time.width(time.duration) });
  for (const canvas of area.querySelectorAll(".thumbnail")) canvas.style.left = time.percent(Number(canvas.dataset.at));
}

// Returns the moment to which a key moves, inside the bag; null for other keys.
function momentAfter(key, moment, bag, step) {
  const to = { ArrowRight: moment + step, ArrowLeft: moment - step, Home: bag.begin, End: bag.end }[key];
  return to === undefined ? null : Math.min(bag.end, Math.max(bag.begin, to));
}

// A click or a drag moves the moment; with the shift key, a drag selects a part. The wheel moves or zooms.
// `on.time` is the visible time, null without a bag; `on` also has `draw(isChanged)`, `select(range)` and `jump(seconds)`.
function listenToPointer(area, lanes, on) {
  let from = null;

  function timeAt(event) {
    const bounds = area.getBoundingClientRect();
    const part = Math.min(1, Math.max(0, (event.clientX - bounds.left) / bounds.width));
    return on.time.first + part * on.time.span;
  }

  area.addEventListener("pointerdown", (event) => {
    if (!on.time || event.button !== 0) return;
    area.setPointerCapture(event.pointerId);
    from = timeAt(event);
    if (event.shiftKey) on.select(null);
    else on.jump(from);
  });
  area.addEventListener("pointermove", (event) => {
    if (from === null) return;
    const to = timeAt(event);
    if (event.shiftKey) on.select([Math.min(from, to), Math.max(from, to)]);
    else on.jump(to);
  });
  for (const kind of ["pointerup", "pointercancel"]) area.addEventListener(kind, () => { from = null; });
  lanes.addEventListener("wheel", (event) => {
    const { time } = on;
    if (!time) return;
    event.preventDefault();
    const isSideways = Math.abs(event.deltaX) > Math.abs(event.deltaY);
    on.draw(isSideways ? time.show(time.first + (event.deltaX / area.clientWidth) * time.span, time.span)
      : time.zoom(1.002 ** event.deltaY, timeAt(event)));
  }, { passive: false });
}
