// The tracks of a timeline: the name of each topic, its message density, and thumbnails of its images.

import { h } from "../dom.js";
import { live } from "../live.js";
import { drawImage, extremes } from "../image_drawing.js";

const IMAGES = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];
const THUMBNAIL_WIDTH = 84;
const MAX_THUMBNAILS = 30;
const THUMBNAILS_MS = 300; // delay after the last change of the visible time

const isImage = (track) => IMAGES.includes(track.type);

export function trackName(track, onChoose) {
  return h("label", { class: isImage(track) ? "name tall" : "name", title: `${track.topic}: ${track.count} messages of ${track.type}` },
    h("input", { type: "checkbox", checked: true, "data-topic": track.topic, onchange: onChoose }), h("span", {}, track.topic),
    h("span", { class: "pale" }, String(track.count)));
}

export function lane(track) {
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

// The thumbnails in the lanes of `area`. They are requested when the visible time has not changed for a moment.
export function thumbnailsIn(area) {
  const closers = [];
  let whenStill = 0;
  return {
    draw(bag, time) {
      clearTimeout(whenStill);
      whenStill = setTimeout(() => {
        for (const close of closers.splice(0)) close();
        for (const canvas of area.querySelectorAll(".thumbnail")) canvas.remove();
        closers.push(...bag.tracks.filter(isImage).map((track) => addThumbnails(area, bag, track, time)));
      }, area.querySelector(".thumbnail") ? THUMBNAILS_MS : 0);
    },
    close() {
      clearTimeout(whenStill);
      closers.forEach((close) => close());
    },
  };
}

// Adds thumbnails of the visible time to the lane of a track, each as soon as it arrives. Returns a function
// that stops this.
function addThumbnails(area, bag, track, time) {
  const own = area.querySelector(`[data-topic="${CSS.escape(track.topic)}"]`);
  const number = Math.min(MAX_THUMBNAILS, Math.max(1, Math.floor(area.clientWidth / THUMBNAIL_WIDTH)));
  const { first, span } = time;
  return live.watch("bag_thumbnails", { name: bag.name, topic: track.topic, times: time.spread(number) }, async (data) => {
    const canvas = h("canvas", { class: "thumbnail", width: 2, height: 2, role: "img", "aria-label": `Image of ${track.topic}` });
    try {
      const head = await drawImage(canvas, data, extremes, null, true);
      if (time.first !== first || time.span !== span) return; // others were requested meanwhile
      canvas.dataset.at = head.at;
      canvas.style.left = time.percent(head.at);
      own.append(canvas);
    } catch {
      // an image that the browser cannot decode has no thumbnail
    }
  });
}
