// The topics of a bag as tracks on a timeline: how dense their messages are, images as thumbnails, the moment, a selection.

import { h, replace } from "../dom.js";
import { live } from "../live.js";
import { drawImage } from "../tabs/images.js";
import { elapsed } from "./playback.js";

const IMAGES = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];
const THUMBNAIL_WIDTH = 84;
const MOST_THUMBNAILS = 30;
const MOST_TICKS = 6;
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400, 43200, 86400];
const STEP = 0.01; // of the duration, by an arrow key

// Round times from 0 on, at most six.
function roundTimes(span) {
  const step = STEPS_S.find((each) => span / each < MOST_TICKS) ?? span / MOST_TICKS;
  return Array.from({ length: Math.ceil(span / step) }, (_, index) => index * step);
}

// `on.jump(seconds)`, `on.toggle()`, `on.select([from, to] or null)` and `on.choose()` are called with what the user does.
export function timeline(on) {
  const cursor = h("div", { class: "cursor" });
  const chosen = h("div", { class: "selection", hidden: true });
  const axis = h("div", { class: "axis" });
  const area = h("div", { class: "area", tabindex: 0, role: "slider", "aria-label": "Moment", title: "Click or drag to jump; with Shift, select a part. Escape clears the selection.", onkeydown: (event) => onKey(event) }, chosen, cursor);
  const names = h("div", { class: "names" });
  const element = h("div", { class: "timeline" }, names, h("div", { class: "lanes" }, axis, area));
  let bag = null;
  let moment = 0;
  let selection = null;
  let closers = [];

  const span = () => Math.max(bag.end - bag.begin, 1e-9);
  const percent = (time) => `${(100 * (time - bag.begin)) / span()}%`;

  function timeAt(event) {
    const bounds = area.getBoundingClientRect();
    const part = Math.min(1, Math.max(0, (event.clientX - bounds.left) / bounds.width));
    return bag.begin + part * span();
  }

  // Shows the tracks of a bag.
  function show(next) {
    bag = next;
    for (const close of closers) close();
    closers = [];
    select(null);
    replace(names, h("div", { class: "axis" }), bag.tracks.map((track) => h("label", { class: isImage(track) ? "name tall" : "name", title: `${track.topic}: ${track.count} messages of ${track.type}` },
      h("input", { type: "checkbox", checked: true, "data-topic": track.topic, onchange: () => on.choose() }), h("span", {}, track.topic), h("span", { class: "pale" }, String(track.count)))));
    replace(axis, roundTimes(span()).map((time) => {
      const tick = h("span", { class: "tick" }, elapsed(time));
      tick.style.left = `${(100 * time) / span()}%`;
      return tick;
    }));
    replace(area, bag.tracks.map(lane), chosen, cursor);
    area.setAttribute("aria-valuemin", "0");
    area.setAttribute("aria-valuemax", span().toFixed(1));
    for (const track of bag.tracks.filter(isImage)) addThumbnails(track);
  }

  const isImage = (track) => IMAGES.includes(track.type);

  function lane(track) {
    const canvas = h("canvas", { width: track.bins.length, height: 1, "aria-hidden": "true" });
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
    const times = Array.from({ length: number }, (_, at) => bag.begin + ((at + 0.5) * span()) / number);
    closers.push(live.watch("bag_thumbnails", { name: bag.name, topic: track.topic, times }, async (data) => {
      const canvas = h("canvas", { class: "thumbnail", width: 2, height: 2, role: "img", "aria-label": `Image of ${track.topic}` });
      try {
        const head = await drawImage(canvas, data);
        canvas.style.left = percent(head.at);
        own.append(canvas);
      } catch {
        // an image that the browser cannot decode has no thumbnail
      }
    }));
  }

  function setMoment(time) {
    moment = time;
    cursor.style.left = percent(time);
    area.setAttribute("aria-valuenow", (time - bag.begin).toFixed(1));
    area.setAttribute("aria-valuetext", elapsed(time - bag.begin));
  }

  function select(range) {
    selection = range;
    chosen.hidden = !range;
    if (range) Object.assign(chosen.style, { left: percent(range[0]), width: `${(100 * (range[1] - range[0])) / span()}%` });
    on.select(range);
  }

  function onKey(event) {
    if (event.key === " ") { event.preventDefault(); on.toggle(); return; }
    if (event.key === "Escape") { select(null); return; }
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
  for (const kind of ["pointerup", "pointercancel"]) area.addEventListener(kind, () => { from = null; });

  return {
    element, show, setMoment, select,
    topics: () => [...names.querySelectorAll("input")].filter((box) => box.checked).map((box) => box.dataset.topic),
    close: () => closers.forEach((close) => close()),
  };
}
