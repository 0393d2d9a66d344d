// Images: this module converts pixels; the browser decodes compressed images.

import { depthOf } from "../depth_png.js";
import { bandwidth, download, h, hertz, replace } from "../dom.js";
import { whyNoData } from "../why_no_data.js";

const CHOOSE = "Choose a topic";
const TYPES = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];

export function open(view, argument, context) {
  const choice = h("select", { "aria-label": "Topic", onchange: () => { context.remember(choice.value); look(choice.value); } });
  const figures = h("span", {});
  const error = h("div", { class: "error", role: "alert" });
  const canvas = h("canvas", { width: 2, height: 2, hidden: true, role: "img", "aria-label": "Image" });
  const hint = h("div", { class: "note" });
  const why = whyNoData(context);
  view.append(h("div", { class: "column" }, h("div", { class: "bar" }, choice, figures, h("span", { class: "spring" }),
    h("button", { onclick: () => canvas.toBlob((blob) => download("image.png", blob)) }, "Save PNG")), error, hint, why.element,
      h("div", { class: "scroll picture" }, canvas)));
  let topic = argument;
  let close = () => {};

  context.watch("topics", {}, (data) => {
    const names = data.topics.filter((each) => TYPES.includes(each.type)).map((each) => each.name);
    if (topic && !names.includes(topic)) names.unshift(topic);
    if (!topic && names.length === 1) look(names[0]);
    if (!topic) offer(names);
    if (!topic) names.unshift("");
    if ([...choice.options].map((option) => option.value).join() === names.join()) return;
    replace(choice, names.map((name) => h("option", { value: name, selected: name === topic }, name || CHOOSE)));
  });

  function offer(names) {
    if (hint.dataset.shown === names.join()) return;
    hint.dataset.shown = names.join();
    replace(hint, names.length ? `${CHOOSE}: there are ${names.length} image topics.` : "There are no image topics.",
      h("div", { class: "choice" }, names.map((name) => h("button",
        { onclick: () => { choice.value = name; context.remember(name); look(name); } }, name))));
  }

  function look(name) {
    close();
    topic = name;
    replace(error, "");
    replace(figures);
    canvas.hidden = true;
    hint.hidden = false;
    delete hint.dataset.shown;
    replace(hint, name ? "No image received yet." : CHOOSE);
    why.offer(name);
    close = name ? context.watch("image", { name }, show, fail) : () => {};
  }

  function fail(problem) {
    replace(error, problem);
    hint.hidden = Boolean(problem) || !canvas.hidden;
  }

  async function show(data) {
    let head = headOf(data);
    try {
      head = await drawImage(canvas, data);
      canvas.hidden = false;
      hint.hidden = true;
      why.offer("");
      replace(error, "");
    } catch (problem) {
      fail(`The image cannot be shown: ${problem.message}`);
    }
    replace(figures, `${head.full?.join(" × ") ?? ""} ${head.encoding ?? head.format}${head.frame ? `, ${head.frame}` : ""} · ` +
      `${hertz(head.rate)} · ${bandwidth(head.bandwidth)}`);
  }

  context.onSource(() => { if (topic) canvas.hidden = true; });
  if (topic) {
    replace(choice, h("option", { value: topic }, topic));
    look(topic);
  }
  return { go: (name) => { choice.value = name; look(name); } };
}

function headOf(data) {
  const all = new Uint8Array(data.buffer, data.byteOffset);
  return JSON.parse(new TextDecoder().decode(all.subarray(0, all.indexOf(10))));
}

// Draws an image that the server sent, a JSON header and pixels, and returns the header.
// `boundsOf(values)` returns the values of black and white of 16-bit and float images.
export async function drawImage(canvas, data, boundsOf = extremes) {
  const head = headOf(data);
  const all = new Uint8Array(data.buffer, data.byteOffset);
  const pixels = all.subarray(all.indexOf(10) + 1);
  const drawing = canvas.getContext("2d");
  if (head.compressed === "depth") {
    const depth = await depthOf(pixels, head.quantised);
    Object.assign(canvas, { width: depth.width, height: depth.height });
    drawing.putImageData(new ImageData(shaded(depth.values, boundsOf), depth.width, depth.height), 0, 0);
    head.full = [depth.width, depth.height];
  } else if (head.compressed) {
    const image = await createImageBitmap(new Blob([pixels], { type: `image/${head.compressed}` }));
    Object.assign(canvas, { width: image.width, height: image.height });
    drawing.drawImage(image, 0, 0);
    head.full = [image.width, image.height];
    head.encoding = head.format;
  } else if (head.width && head.height) {
    Object.assign(canvas, { width: head.width, height: head.height });
    drawing.putImageData(new ImageData(colours(head, pixels, boundsOf), head.width, head.height), 0, 0);
  }
  return head;
}

// Converts pixels to RGBA.
// `color` and `depth` are those of pipros.pictures.encodings: "bgr", "gray", the pattern "rggb", the bytes "uyvy" of two pixels.
export function colours({ color, depth, big, width, height }, pixels, boundsOf = extremes) {
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
  const grey = depth === "8U" ? pixels : stretched(depth, big, count, pixels, boundsOf);
  for (let i = 0; i < count; i += 1) out[i * 4] = out[i * 4 + 1] = out[i * 4 + 2] = grey[i];
  return out;
}

// Scales 16-bit and float pixels from black to white. NaN and infinity are black.
function stretched(depth, big, count, pixels, boundsOf) {
  const view = new DataView(pixels.buffer, pixels.byteOffset, pixels.byteLength);
  const read = depth === "32F" ? (i) => view.getFloat32(i * 4, !big) : (i) => view.getUint16(i * 2, !big);
  return scaled(Float64Array.from({ length: count }, (_, i) => read(i)), boundsOf);
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

// Converts depths to RGBA, from black to white.
function shaded(depths, boundsOf) {
  const shades = scaled(depths, boundsOf);
  const out = new Uint8ClampedArray(depths.length * 4).fill(255);
  shades.forEach((shade, i) => out.fill(shade, i * 4, i * 4 + 3));
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
