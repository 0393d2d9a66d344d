// The topics of a bag as tracks on a timeline, with message density, thumbnails of images, the moment, and a selection.

import { h, replace } from "../dom.js";
import { live } from "../live.js";
import { drawImage } from "../tabs/images.js";
import { elapsed } from "./playback.js";

const IMAGES = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];
const THUMBNAIL_WIDTH = 84;
const MOST_THUMBNAILS = 30;
const MOST_TICKS = 6;
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400, 43200, 86400];
const STEP = 0.01; // part of the visible time by which an arrow key moves the moment
const ZOOMS = { "+": 1 / 1.5, "=": 1 / 1.5, "-": 1.5, 0: Infinity };
const SHORTEST = 0.5; // minimum visible time in seconds
const THUMBNAILS_MS = 300; // delay after the last change of the visible time

// Returns at most six round times between two times.
function roundTimes(begin, end) {
  const step = STEPS_S.find((each) => (end - begin) / each < MOST_TICKS) ?? (end - begin) / MOST_TICKS;
  const first = Math.ceil(begin / step);
  return Array.from({ length: Math.max(0, Math.ceil(end / step) - first) }, (_, index) => (first + index) * step);
}

// `on.jump(seconds)`, `on.toggle()`, `on.select([from, to] or null)` and `on.choose()` are called for the user's actions.
export function timeline(on) {
  const cursor = h("div", { class: "cursor" });
  const chosen = h("div", { class: "selection", hidden: true });
  const axis = h("div", { class: "axis" });
  const area = h("div", { class: "area", tabindex: 0, role: "slider", "aria-label": "Moment",
    title: "Click or drag to jump; with Shift, select a part. Escape clears the selection. The wheel, + and - zoom; 0 shows the whole " +
      "bag.", onkeydown: (event) => onKey(event) }, chosen, cursor);
  const names = h("div", { class: "names" });
  const lanes = h("div", { class: "lanes" }, axis, area);
  const element = h("div", { class: "timeline" }, names, lanes);
  let bag = null;
  let moment = 0;
  let selection = null;
  const closers = [];
  let visible = [0, 1]; // the first and the last time
  let whenStill = 0;

  const duration = () => Math.max(bag.end - bag.begin, 1e-9);
  const span = () => visible[1] - visible[0];
  const percent = (time) => `${(100 * (time - visible[0])) / span()}%`;

  function timeAt(event) {
    const bounds = area.getBoundingClientRect();
    const part = Math.min(1, Math.max(0, (event.clientX - bounds.left) / bounds.width));
    return visible[0] + part * span();
  }

  // Shows a part of the time, shifted or shortened to fit into the bag's.
  function look(begin, length) {
    const wanted = Math.min(duration(), Math.max(Math.min(SHORTEST, duration()), length));
    const first = Math.min(bag.begin + duration() - wanted, Math.max(bag.begin, begin));
    if (visible[0] === first && span() === wanted) return;
    visible = [first, first + wanted];
    draw();
  }

  // Zooms so that `time` stays at its place.
  const zoom = (factor, time) => look(time - (time - visible[0]) * Math.min(factor, duration() / span()), span() * factor);

  // Draws what depends on the visible times.
  function draw() {
    replace(axis, roundTimes(visible[0] - bag.begin, visible[1] - bag.begin).map((time) => {
      const tick = h("span", { class: "tick" }, elapsed(time));
      tick.style.left = percent(bag.begin + time);
      return tick;
    }));
    for (const canvas of area.querySelectorAll(".density"))
      Object.assign(canvas.style, { left: percent(bag.begin), width: `${(100 * duration()) / span()}%` });
    for (const canvas of area.querySelectorAll(".thumbnail")) canvas.style.left = percent(Number(canvas.dataset.at));
    place();
    clearTimeout(whenStill);
    whenStill = setTimeout(() => {
      for (const close of closers.splice(0)) close();
      for (const canvas of area.querySelectorAll(".thumbnail")) canvas.remove();
      for (const track of bag.tracks.filter(isImage)) addThumbnails(track);
    }, area.querySelector(".thumbnail") ? THUMBNAILS_MS : 0);
  }

  // Places the moment and the selection.
  function place() {
    cursor.style.left = percent(moment);
    if (selection) Object.assign(chosen.style, { left: percent(selection[0]),
      width: `${(100 * (selection[1] - selection[0])) / span()}%` });
  }

  // Shows the tracks of a bag.
  function show(next) {
    bag = next;
    moment = bag.begin;
    visible = [bag.begin, bag.begin + duration()];
    select(null);
    replace(names, h("div", { class: "axis" }), bag.tracks.map((track) =>
      h("label", { class: isImage(track) ? "name tall" : "name", title: `${track.topic}: ${track.count} messages of ${track.type}` },
      h("input", { type: "checkbox", checked: true, "data-topic": track.topic, onchange: () => on.choose() }), h("span", {}, track.topic),
        h("span", { class: "pale" }, String(track.count)))));
    replace(area, bag.tracks.map(lane), chosen, cursor);
    area.setAttribute("aria-valuemin", "0");
    area.setAttribute("aria-valuemax", duration().toFixed(1));
    draw();
  }

  const isImage = (track) => IMAGES.includes(track.type);

  function lane(track) {
    const canvas = h("canvas", { class: "density", width: track.bins.length, height: 1, "aria-hidden": "true" });
    const drawing = canvas.getContext("2d");
    const most = Math.max(...track.bins);
    drawing.fillStyle = "#2f6fb3";
    track.bins.forEach((count, at) => {
      if (!count) return;
      drawing.globalAlpha = 0.3 + (0.7 * count) / most;
      drawing.fillRect(at, 0, 1, 1);
    });
    return h("div", { class: isImage(track) ? "lane tall" : "lane", "data-topic": track.topic }, canvas);
  }

  function addThumbnails(track) {
    const own = area.querySelector(`[data-topic="${CSS.escape(track.topic)}"]`);
    const number = Math.min(MOST_THUMBNAILS, Math.max(1, Math.floor(area.clientWidth / THUMBNAIL_WIDTH)));
    const shown = visible;
    const times = Array.from({ length: number }, (_, at) => visible[0] + ((at + 0.5) * span()) / number);
    closers.push(live.watch("bag_thumbnails", { name: bag.name, topic: track.topic, times }, async (data) => {
      const canvas = h("canvas", { class: "thumbnail", width: 2, height: 2, role: "img", "aria-label": `Image of ${track.topic}` });
      try {
        const head = await drawImage(canvas, data);
        if (visible !== shown) return; // others are requested
        canvas.dataset.at = head.at;
        canvas.style.left = percent(head.at);
        own.append(canvas);
      } catch {
        // an image that the browser cannot decode has no thumbnail
      }
    }));
  }

  function setMoment(time) {
    moment = time;
    if (time < visible[0] || time > visible[1]) look(time - span() / 10, span());
    place();
    area.setAttribute("aria-valuenow", (time - bag.begin).toFixed(1));
    area.setAttribute("aria-valuetext", elapsed(time - bag.begin));
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
    if (event.key in ZOOMS && bag) { event.preventDefault(); zoom(ZOOMS[event.key], moment); return; }
    const to = { ArrowRight: moment + STEP * span(), ArrowLeft: moment - STEP * span(), Home: bag?.begin, End: bag?.end }[event.key];
    if (to === undefined || !bag) return;
    event.preventDefault();
    const time = Math.min(bag.end, Math.max(bag.begin, to));
    if (event.shiftKey) select([Math.min(selection?.[0] ?? moment, time), Math.max(selection?.[0] ?? moment, time)]);
    on.jump(time);
  }

  // A click or a drag moves the moment; with the shift key, it selects a part.
  let from = null;
  area.addEventListener("pointerdown", (event) => {
    if (!bag || event.button !== 0) return;
    area.setPointerCapture(event.pointerId);
    from = timeAt(event);
    if (event.shiftKey) select(null);
    else on.jump(from);
  });
  area.addEventListener("pointermove", (event) => {
    if (from === null) return;
    const time = timeAt(event);
    if (event.shiftKey) select([Math.min(from, time), Math.max(from, time)]);
    else on.jump(time);
  });
  lanes.addEventListener("wheel", (event) => {
    if (!bag) return;
    event.preventDefault();
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) look(visible[0] + (event.deltaX / area.clientWidth) * span(), span());
    else zoom(1.002 ** event.deltaY, timeAt(event));
  }, { passive: false });
  for (const kind of ["pointerup", "pointercancel"]) area.addEventListener(kind, () => { from = null; });

  return {
    element, show, setMoment, select,
    topics: () => [...names.querySelectorAll("input")].filter((box) => box.checked).map((box) => box.dataset.topic),
    close: () => { clearTimeout(whenStill); closers.forEach((close) => close()); },
  };
}
