// Images: this module converts pixels; the browser decodes compressed images.

import { depthOf } from "../depth_png.js";
import { bandwidth, download, h, hertz, replace } from "../dom.js";
import { COLOUR_MAPS, numberText, paletteOf, unsupportedTransport } from "../image_colours.js";
import { imageZoom } from "../image_zoom.js";
import { whyNoData } from "../why_no_data.js";

const CHOOSE = "Choose a topic";
const TYPES = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];

export function open(view, argument, context) {
  const choice = h("select", { "aria-label": "Topic", onchange: () => { context.remember(choice.value); look(choice.value); } });
  const figures = h("span", {});
  const error = h("div", { class: "error", role: "alert" });
  const hint = h("div", { class: "note" });
  const why = whyNoData(context);
  const stage = imageStage();
  view.append(h("div", { class: "column" }, h("div", { class: "bar" }, choice, figures, stage.pixel, h("span", { class: "spring" }),
    stage.controls), error, hint, why.element, stage.area));
  let topic = argument;
  let close = () => {};

  context.watch("topics", {}, (data) => {
    const names = data.topics.filter((each) => TYPES.includes(each.type) || unsupportedTransport(each)).map((each) => each.name);
    const shown = data.topics.find((each) => each.name === topic);
    if (shown && unsupportedTransport(shown)) refuse(unsupportedTransport(shown));
    if (topic && !names.includes(topic)) names.unshift(topic);
    if (!topic && names.length === 1) look(names[0]);
    if (!topic) offer(hint, names, (name) => { choice.value = name; context.remember(name); look(name); });
    if (!topic) names.unshift("");
    if ([...choice.options].map((option) => option.value).join() === names.join()) return;
    replace(choice, names.map((name) => h("option", { value: name, selected: name === topic }, name || CHOOSE)));
  });

  // Shows why a topic cannot be shown.
  function refuse(text) {
    close();
    close = () => {};
    stage.clear();
    hint.hidden = false;
    why.offer("");
    replace(hint, text);
  }

  function look(name) {
    close();
    topic = name;
    replace(error, "");
    replace(figures);
    stage.clear();
    hint.hidden = false;
    delete hint.dataset.shown;
    replace(hint, name ? "No image received yet." : CHOOSE);
    why.offer(name);
    close = name ? context.watch("image", { name }, show, fail) : () => {};
  }

  function fail(problem) {
    replace(error, problem);
    hint.hidden = Boolean(problem) || !stage.canvas.hidden;
  }

  async function show(data) {
    let head = headOf(data);
    const refusal = unsupportedTransport({ name: topic, type: head.format ?? "" });
    if (refusal) { refuse(refusal); return; }
    try {
      head = await stage.show(data);
      hint.hidden = true;
      why.offer("");
      replace(error, "");
    } catch (problem) {
      fail(`The image cannot be shown: ${problem.message}`);
    }
    replace(figures, `${head.full?.join(" × ") ?? ""} ${head.encoding ?? head.format}${head.frame ? `, ${head.frame}` : ""} · ` +
      `${hertz(head.rate)} · ${bandwidth(head.bandwidth)}`);
  }

  context.onSource(() => { if (topic) stage.canvas.hidden = true; });
  if (topic) {
    replace(choice, h("option", { value: topic }, topic));
    look(topic);
  }
  return { go: (name) => { choice.value = name; look(name); } };
}

// Shows a choice of topics as a hint.
function offer(hint, names, onChoose) {
  if (hint.dataset.shown === names.join()) return;
  hint.dataset.shown = names.join();
  replace(hint, names.length ? `${CHOOSE}: there are ${names.length} image topics.` : "There are no image topics.",
    h("div", { class: "choice" }, names.map((name) => h("button", { onclick: () => onChoose(name) }, name))));
}

// A picture with its controls, and the pixel under the cursor.
function imageStage() {
  const canvas = h("canvas", { width: 2, height: 2, hidden: true, role: "img", "aria-label": "Image" });
  const area = h("div", { class: "picture", role: "application", "aria-label": "Picture: + and - zoom, arrow keys move, 0 fits" }, canvas);
  const pixel = h("span", { class: "pixel mono", role: "status" });
  const range = rangeControls(() => last && show(last));
  const zoom = imageZoom(canvas, (at) => { cursor = at; tell(); });
  const save = h("button", { onclick: () => canvas.toBlob((blob) => download("image.png", blob)) }, "Save PNG");
  let last = null; // the newest image, as it was received
  let head = null; // its header
  let cursor = null; // the pixel under the cursor

  function tell() {
    replace(pixel, cursor && head?.valueAt ? `(${cursor.x}, ${cursor.y}): ${head.valueAt(cursor.x, cursor.y)}` : "");
  }

  // Returns a promise of the header.
  async function show(data) {
    last = data;
    head = await drawImage(canvas, data, range.boundsOf, range.palette());
    canvas.hidden = false;
    range.offer(Boolean(head.values));
    tell();
    return head;
  }

  function clear() {
    [last, head] = [null, null];
    canvas.hidden = true;
    range.offer(false);
    zoom.fit();
    tell();
  }

  return { area, canvas, pixel, controls: [range.element, zoom.buttons, save], show, clear };
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

function headOf(data) {
  const all = new Uint8Array(data.buffer, data.byteOffset);
  return JSON.parse(new TextDecoder().decode(all.subarray(0, all.indexOf(10))));
}

// Draws an image that the server sent, a JSON header and pixels, and returns the header, with `valueAt(x, y)`, a text, and for
// 16-bit and float images with `values`.
//   boundsOf: function from values to those of black and white
//   palette: RGB of the 256 shades; null for grey
export async function drawImage(canvas, data, boundsOf = extremes, palette = null) {
  const head = headOf(data);
  const refusal = unsupportedTransport({ name: head.topic ?? "", type: head.format ?? "" });
  if (refusal) throw new Error(refusal);
  const all = new Uint8Array(data.buffer, data.byteOffset);
  const pixels = all.subarray(all.indexOf(10) + 1);
  const drawing = canvas.getContext("2d");
  if (head.compressed === "depth") {
    const depth = await depthOf(pixels, head.quantised);
    Object.assign(canvas, { width: depth.width, height: depth.height });
    head.values = depth.values;
    drawing.putImageData(new ImageData(shaded(depth.values, boundsOf, palette), depth.width, depth.height), 0, 0);
    head.full = [depth.width, depth.height];
  } else if (head.compressed) {
    const image = await createImageBitmap(new Blob([pixels], { type: `image/${head.compressed}` }));
    Object.assign(canvas, { width: image.width, height: image.height });
    drawing.drawImage(image, 0, 0);
    head.full = [image.width, image.height];
    head.encoding = head.format;
  } else if (head.width && head.height) {
    Object.assign(canvas, { width: head.width, height: head.height });
    if (head.color === "gray" && head.depth !== "8U") head.values = numbersOf(head, pixels);
    const rgba = head.values ? shaded(head.values, boundsOf, palette) : colours(head, pixels);
    drawing.putImageData(new ImageData(rgba, head.width, head.height), 0, 0);
  }
  const isMetres = head.compressed === "depth" || head.depth === "32F";
  head.valueAt = (x, y) => (head.values ? numberText(head.values[y * canvas.width + x], isMetres)
    : [...drawing.getImageData(x, y, 1, 1).data.slice(0, 3)].join(", "));
  return head;
}

// Converts pixels to RGBA.
// `color` and `depth` are those of pipros.pictures.encodings: "bgr", "gray", the pattern "rggb", the bytes "uyvy" of two pixels.
export function colours(head, pixels, boundsOf = extremes) {
  const { color, depth, width, height } = head;
  const count = width * height;
  const out = new Uint8ClampedArray(count * 4).fill(255);
  if (/^(rgb|bgr)a?$/.test(color)) {
    const [r, g, b] = [..."rgb"].map((channel) => color.indexOf(channel));
    for (let i = 0, at = 0; i < count; i += 1, at += color.length) {
      out[i * 4] = pixels[at + r];
      out[i * 4 + 1] = pixels[at + g];
      out[i * 4 + 2] = pixels[at + b];
    }
    return out;
  }
  if (color.includes("y") && color !== "gray") return fromYuv(color, count, pixels, out);
  if (color !== "gray") return fromBayer(color, width, height, pixels, out);
  if (depth !== "8U") return shaded(numbersOf(head, pixels), boundsOf);
  const grey = pixels;
  for (let i = 0; i < count; i += 1) out[i * 4] = out[i * 4 + 1] = out[i * 4 + 2] = grey[i];
  return out;
}

// Returns the numbers of 16-bit and float pixels.
function numbersOf({ depth, big, width, height }, pixels) {
  const view = new DataView(pixels.buffer, pixels.byteOffset, pixels.byteLength);
  const read = depth === "32F" ? (i) => view.getFloat32(i * 4, !big) : (i) => view.getUint16(i * 2, !big);
  return Float64Array.from({ length: width * height }, (_, i) => read(i));
}

// Returns the least and the largest finite value.
/** @type {(values: Iterable<number>) => number[]} */
export function extremes(values) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  return [low, high];
}

function scaled(values, boundsOf) {
  const [low, high] = boundsOf(values);
  return values.map((value) => (Number.isFinite(value) && high > low ? ((value - low) * 255) / (high - low) : 0));
}

// Converts numbers to RGBA, from black to white or with a palette. NaN and infinity are black.
function shaded(numbers, boundsOf, palette = null) {
  const shades = Uint8ClampedArray.from(scaled(numbers, boundsOf));
  const out = new Uint8ClampedArray(numbers.length * 4).fill(255);
  for (let i = 0; i < shades.length; i += 1) {
    if (palette && Number.isFinite(numbers[i])) out.set(palette.subarray(shades[i] * 3, shades[i] * 3 + 3), i * 4);
    else out.fill(shades[i], i * 4, i * 4 + 3);
  }
  return out;
}

// `pattern` has the colours of the upper left four pixels.
function fromBayer(pattern, width, height, pixels, out) {
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const sums = { r: [0, 0], g: [0, 0], b: [0, 0] };
      for (let ny = Math.max(0, y - 1); ny <= Math.min(height - 1, y + 1); ny += 1) {
        for (let nx = Math.max(0, x - 1); nx <= Math.min(width - 1, x + 1); nx += 1) {
          const sum = sums[pattern[(ny % 2) * 2 + (nx % 2)]];
          sum[0] += pixels[ny * width + nx];
          sum[1] += 1;
        }
      }
      const at = (y * width + x) * 4;
      out[at] = sums.r[0] / (sums.r[1] || 1);
      out[at + 1] = sums.g[0] / (sums.g[1] || 1);
      out[at + 2] = sums.b[0] / (sums.b[1] || 1);
    }
  }
  return out;
}

// `order` has the letters of the four bytes of two pixels.
function fromYuv(order, count, pixels, out) {
  const [y0, u, y1, v] = [order.indexOf("y"), order.indexOf("u"), order.lastIndexOf("y"), order.indexOf("v")];
  for (let i = 0; i < count; i += 1) {
    const at = (i >> 1) * 4;
    const luma = pixels[at + (i % 2 ? y1 : y0)];
    const du = pixels[at + u] - 128;
    const dv = pixels[at + v] - 128;
    out[i * 4] = luma + 1.402 * dv;
    out[i * 4 + 1] = luma - 0.344 * du - 0.714 * dv;
    out[i * 4 + 2] = luma + 1.772 * du;
  }
  return out;
}
