// A picture with zoom, range, overlays and the value under the cursor.

import { download, h, replace } from "./dom.js";
import { COLOUR_MAPS, paletteOf } from "./image_colours.js";
import { drawDifference, drawImage, extremes } from "./image_drawing.js";
import { drawShapes } from "./image_overlay.js";
import { imageZoom } from "./image_zoom.js";

const SHARP = 1200; // pixels
const KEPT = 20; // number of lists of shapes that are kept
const APART_NS = 5e8; // largest difference between the stamps of shapes and image

// A picture with its controls, and the pixel under the cursor.
export function imageStage(label = "Image") {
  const canvas = h("canvas", { width: 2, height: 2, hidden: true, role: "img", "aria-label": label });
  const overlay = h("canvas", { class: "over", "aria-hidden": "true" });
  const area = h("div", { class: "picture", role: "application", "aria-label": "Picture: + and - zoom, arrow keys move, 0 fits" }, canvas);
  const pixel = h("span", { class: "pixel mono", role: "status" });
  const range = rangeControls(() => last && show(last));
  const zoom = imageZoom(canvas, (at) => { cursor = at; tell(); });
  const save = h("button", { onclick: () => saveAll(canvas, overlay) }, "Save PNG");
  let last = null; // the newest image, as it was received
  let head = null; // its header
  let cursor = null; // the pixel under the cursor
  let turn = 0; // counts how often the stage was cleared
  let shapes = []; // {stamp, shapes} to draw over the image, the newest last

  function tell() {
    replace(pixel, cursor && head ? `(${cursor.x}, ${cursor.y}): ${head.valueAt(cursor.x, cursor.y)}` : "");
  }

  // Returns a promise of the header.
  async function show(data) {
    last = data;
    return finish(await drawImage(canvas, data, range.boundsOf, range.palette(), true), turn);
  }

  // Shows the difference of two images.
  async function showDifference(one, other) {
    last = null;
    return finish(await drawDifference(canvas, one, other, range.boundsOf, range.palette()), turn);
  }

  // Shows what was drawn, unless the stage was cleared meanwhile: browsers decode images in the background.
  function finish(drawn, begun) {
    if (begun !== turn) return drawn;
    head = drawn;
    canvas.hidden = false;
    range.offer(Boolean(head.values));
    drawOver();
    tell();
    return drawn;
  }

  // Draws shapes over the image: a list of {stamp, shapes}, see image_overlay.js. Those with the stamp of the
  // image are drawn; if there are none, the newest within 0.5 s of it, or without a stamp.
  function over(next) {
    shapes = [...shapes, ...next].slice(-KEPT);
    drawOver();
  }

  function drawOver() {
    const found = canvas.hidden ? null : shapesFor(head.stamp, shapes);
    if (!found?.length) { overlay.remove(); return; }
    if (!overlay.isConnected) canvas.after(overlay);
    overlay.style.transform = canvas.style.transform;
    const times = Math.max(1, Math.ceil(SHARP / canvas.width)); // shapes are sharp over small images, too
    Object.assign(overlay, { width: canvas.width * times, height: canvas.height * times });
    drawShapes(overlay.getContext("2d"), found, overlay.width / (head.full?.[0] || canvas.width));
  }

  // Removes the picture, but keeps the shapes and the zoom for the next one.
  function blank() {
    [last, head] = [null, null];
    turn += 1;
    canvas.hidden = true;
    overlay.remove();
    tell();
  }

  function clear() {
    blank();
    shapes = [];
    range.offer(false);
    zoom.fit();
  }

  return { area, canvas, pixel, zoom, controls: [range.element, zoom.buttons, save], show, showDifference, over, blank, clear };
}

// Saves the picture as it is drawn.
function saveAll(canvas, overlay) {
  const all = overlay.isConnected ? h("canvas", { width: overlay.width, height: overlay.height }) : canvas;
  if (overlay.isConnected) for (const each of [canvas, overlay]) all.getContext("2d").drawImage(each, 0, 0, all.width, all.height);
  all.toBlob((blob) => download("image.png", blob));
}

// Returns the shapes for an image. Without stamps, these are the newest ones.
function shapesFor(stamp, all) {
  const isNear = (each) => !stamp || !each.stamp || Math.abs(each.stamp - stamp) <= APART_NS;
  return (all.findLast((each) => stamp && each.stamp === stamp) ?? all.findLast(isNear))?.shapes;
}

// Fields for the values of black and white, and a choice of colours, for pictures of numbers. `onChange()` is called after a change.
function rangeControls(onChange) {
  const [low, high] = ["Lowest value", "Highest value"].map((label) =>
    h("input", { size: 6, placeholder: "auto", "aria-label": label, onchange: () => onChange() }));
  const colour = h("select", { "aria-label": "Colours", onchange: () => onChange() },
    COLOUR_MAPS.map((name) => h("option", { value: name }, name)));
  const element = h("span", { class: "choices", hidden: true }, h("label", {}, "from", low), h("label", {}, "to", high), colour);
  const given = (input) => (input.value.trim() === "" || Number.isNaN(Number(input.value)) ? null : Number(input.value));
  return {
    element,
    offer(isWanted) { element.hidden = !isWanted; },
    palette: () => (colour.value === COLOUR_MAPS[0] ? null : paletteOf(colour.value)),
    boundsOf(values) {
      const [least, most] = extremes(values);
      return [given(low) ?? least, given(high) ?? most];
    },
  };
}

