// Draws images: this module converts pixels; the browser decodes compressed images.

import { depthOf } from "./depth_png.js";
import { numberText, unsupportedTransport } from "./image_colours.js";

export function headOf(data) {
  const all = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  return JSON.parse(new TextDecoder().decode(all.subarray(0, all.indexOf(10))));
}

// Draws an image that the server sent (a JSON header, a line feed and the pixels). Returns a promise of the header, to which are
// added `valueAt(x, y)`, which returns a text, and for grey images of more than 8 bits, `values`.
//   boundsOf: returns the values of black and white for all values of the image
//   palette: RGB of the 256 shades; null for grey
//   hasHatches: whether NaN and infinity are hatched, instead of black
// Throws an Error if there are no pixels.
export async function drawImage(canvas, data, boundsOf = extremes, palette = null, hasHatches = false) {
  const head = headOf(data);
  const refusal = unsupportedTransport({ name: head.topic ?? "", type: head.format ?? "" });
  if (refusal) throw new Error(refusal);
  const all = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  const pixels = all.subarray(all.indexOf(10) + 1);
  const drawing = canvas.getContext("2d");
  const shade = (values, width) => shaded(values, boundsOf, palette, hasHatches ? width : 0);
  if (head.compressed === "depth") {
    const depth = await depthOf(pixels, head.quantised);
    Object.assign(canvas, { width: depth.width, height: depth.height });
    head.values = depth.values;
    drawing.putImageData(new ImageData(shade(depth.values, depth.width), depth.width, depth.height), 0, 0);
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
    const rgba = head.values ? shade(head.values, head.width) : colours(head, pixels);
    drawing.putImageData(new ImageData(rgba, head.width, head.height), 0, 0);
  } else throw new Error(`it has no pixels: its size is ${head.full.join(" × ")}`);
  const isMetres = head.compressed === "depth" || head.depth === "32F";
  head.valueAt = (x, y) => (head.values ? numberText(head.values[y * canvas.width + x], isMetres)
    : [...drawing.getImageData(x, y, 1, 1).data.slice(0, 3)].join(", "));
  return head;
}

// Draws the absolute difference of two images of the same size, pixel by pixel: of numbers if both have them, otherwise of colours.
// Returns a header as `drawImage` does. Throws an Error if the sizes differ.
export async function drawDifference(canvas, one, other, boundsOf = extremes, palette = null) {
  const places = [new OffscreenCanvas(2, 2), new OffscreenCanvas(2, 2)];
  const heads = [await drawImage(places[0], one), await drawImage(places[1], other)];
  const [first, second] = places;
  const { width, height } = first;
  if (width !== second.width || height !== second.height)
    throw new Error(`the images have different sizes, ${width} × ${height} and ${second.width} × ${second.height}`);
  const [pixels, others] = places.map((each) => each.getContext("2d").getImageData(0, 0, width, height).data);
  const head = { ...heads[0], encoding: "difference" };
  head.values = heads[0].values && heads[1].values ? heads[0].values.map((value, index) => Math.abs(value - heads[1].values[index])) : null;
  const rgba = head.values ? shaded(head.values, boundsOf, palette, width) : differenceOf(pixels, others);
  Object.assign(canvas, { width, height });
  canvas.getContext("2d").putImageData(new ImageData(rgba, width, height), 0, 0);
  const text = (x, y) => [0, 1, 2].map((channel) => rgba[(y * width + x) * 4 + channel]).join(", ");
  const isMetres = heads[0].compressed === "depth" || heads[0].depth === "32F";
  head.valueAt = (x, y) => (head.values ? numberText(head.values[y * width + x], isMetres) : text(x, y));
  return head;
}

// Returns RGBA of the absolute differences.
export function differenceOf(pixels, others) {
  const out = new Uint8ClampedArray(pixels.length).fill(255);
  for (let at = 0; at < pixels.length; at += 1) if (at % 4 !== 3) out[at] = Math.abs(pixels[at] - others[at]);
  return out;
}

// Converts pixels to RGBA.
// `color` and `depth` are those of pipros_libraries.pictures.encodings: "bgr", "gray", the pattern "rggb", the bytes "uyvy" of two pixels.
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

const NUMBERS = { U: "Uint", S: "Int", F: "Float" };

// Returns the numbers of pixels of a depth such as "16S".
function numbersOf({ depth, big, width, height }, pixels) {
  const view = new DataView(pixels.buffer, pixels.byteOffset, pixels.byteLength);
  const bits = parseInt(depth, 10);
  const read = view[`get${NUMBERS[depth.at(-1)]}${bits}`].bind(view);
  return Float64Array.from({ length: width * height }, (_, i) => read((i * bits) / 8, !big));
}

// Returns the smallest and the largest finite value.
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

const HATCHES = [[123, 63, 168], [236, 226, 245]]; // violet, as for stale data
const HATCH_PX = 4;

// Converts numbers to RGBA, from black to white or with a palette. NaN and infinity are black; if the width of the picture is given, they
// are hatched, because the lowest value is black, too.
export function shaded(numbers, boundsOf, palette = null, width = 0) {
  const shades = Uint8ClampedArray.from(scaled(numbers, boundsOf));
  const out = new Uint8ClampedArray(numbers.length * 4).fill(255);
  for (let i = 0; i < shades.length; i += 1) {
    if (width && !Number.isFinite(numbers[i])) out.set(HATCHES[Math.floor(((i % width) + Math.floor(i / width)) / HATCH_PX) % 2], i * 4);
    else if (palette && Number.isFinite(numbers[i])) out.set(palette.subarray(shades[i] * 3, shades[i] * 3 + 3), i * 4);
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
