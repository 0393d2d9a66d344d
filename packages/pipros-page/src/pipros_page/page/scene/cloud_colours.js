// The colour transformers of rviz for point clouds: they turn columns of numbers into colours.

import { rainbow } from "./colours.js";
import { MOST as FARTHEST } from "./pose.js";

const FLOAT32 = 7;
const MOST = 999999; // the limit of automatic bounds of intensities, in rviz
const NUMBERS = [null, Int8Array, Uint8Array, Int16Array, Uint16Array, Int32Array, Uint32Array, Float32Array, Float64Array];

// Returns the fields that a transformer needs.
export function fieldsFor(transformer, channel) {
  if (transformer === "RGB8" || transformer === "MONO8") return ["rgb", "rgba"];
  if (transformer === "RGBF32") return ["r", "g", "b"];
  if (transformer === "Intensity") return [channel, "intensities"];
  if (transformer === "AxisColor" || transformer === "FlatColor") return [];
  return ["rgb", "rgba", channel, "intensities"];
}

// Returns the transformer to use for a cloud with these columns.
export function usableTransformer(chosen, columns, channel) {
  const has = (...names) => names.some((name) => columns.has(name));
  if (chosen === "AxisColor" || chosen === "FlatColor") return chosen;
  if ((chosen === "RGB8" || chosen === "MONO8") && has("rgb", "rgba")) return chosen;
  if (chosen === "RGBF32" && columns.has("r") && columns.has("g") && columns.has("b")) return chosen;
  if (chosen === "Intensity" && has(channel, "intensities")) return chosen;
  if (has("rgb", "rgba")) return "RGB8";
  return has(channel, "intensities") ? "Intensity" : "AxisColor";
}

// Returns the values of columns by name. In `data`, columns follow one another.
export function columnsOf(head, data) {
  const found = new Map();
  let at = data.byteOffset;
  for (const [name, datatype, size] of head.columns) {
    const Numbers = (name === "rgb" || name === "rgba") && datatype >= 5 && datatype <= FLOAT32 ? Uint32Array : NUMBERS[datatype];
    const each = Numbers.BYTES_PER_ELEMENT;
    found.set(name, at % each ? new Numbers(data.buffer.slice(at, at + size)) : new Numbers(data.buffer, at, size / each));
    at += size;
  }
  return found;
}

// Returns RGBA of each point.
//   columns: x, y, z and the fields of the transformer
//   options: the properties of the display: rainbow, invert, minColor, maxColor, autoBounds, bounds, colour, axis, autoAxis,
//   axisBounds; and `heights`, the coordinates along the axis
export function cloudColours(transformer, columns, options) {
  const out = new Uint8Array(columns.get("x").length * 4).fill(255);
  (WRITERS[transformer] ?? heights)(out, columns, options, transformer);
  return out;
}

function flat(out, _columns, { colour }) {
  for (let at = 0; at < out.length; at += 4) [out[at], out[at + 1], out[at + 2]] = colour;
}

function packedColours(out, columns, _options, transformer) {
  const hasAlpha = columns.has("rgba");
  const packed = columns.get(hasAlpha ? "rgba" : "rgb");
  const isGrey = transformer === "MONO8";
  for (let i = 0, at = 0; i < packed.length; i += 1, at += 4) {
    const value = packed[i];
    const [r, g, b] = [(value >> 16) & 255, (value >> 8) & 255, value & 255];
    const grey = (r + g + b) / 3;
    out[at] = isGrey ? grey : r;
    out[at + 1] = isGrey ? grey : g;
    out[at + 2] = isGrey ? grey : b;
    if (hasAlpha && !isGrey) out[at + 3] = value >>> 24;
  }
}

function floatColours(out, columns) {
  ["r", "g", "b"].forEach((name, channel) => {
    columns.get(name).forEach((value, i) => { out[i * 4 + channel] = Math.min(255, Math.max(0, value * 255)); });
  });
}

function intensities(out, columns, options) {
  const values = columns.get(options.channel) ?? columns.get("intensities");
  const [low, high] = options.autoBounds ? bounds(values).map((each) => Math.min(MOST, Math.max(-MOST, each))) : options.bounds;
  const range = high - low || 1e20;
  for (let i = 0; i < values.length; i += 1) {
    const fraction = Math.min(1, Math.max(0, (Number(values[i]) - low) / range));
    if (options.rainbow) rainbow(options.invert ? 1 - fraction : fraction, out, i * 4);
    else for (let c = 0; c < 3; c += 1) out[i * 4 + c] = options.minColor[c] + fraction * (options.maxColor[c] - options.minColor[c]);
  }
}

function heights(out, _columns, { heights: values, autoAxis, axisBounds }) {
  const [low, most] = autoAxis ? bounds(values) : axisBounds;
  const high = most > low ? most : low + 0.001;
  for (let i = 0; i < values.length; i += 1) rainbow((values[i] - low) / (high - low), out, i * 4);
}

function bounds(values) {
  let low = Infinity;
  let high = -Infinity;
  for (let i = 0; i < values.length; i += 1) {
    const value = values[i];
    if (value < low) low = Number(value);
    if (value > high) high = Number(value);
  }
  return low <= high ? [low, high] : [0, 0];
}

// Returns columns without the points whose positions are not finite, or too far to be drawn.
export function finiteOnly(columns) {
  const [xs, ys, zs] = ["x", "y", "z"].map((name) => columns.get(name));
  const isFinite = (i) => Math.abs(xs[i]) <= FARTHEST && Math.abs(ys[i]) <= FARTHEST && Math.abs(zs[i]) <= FARTHEST;
  let first = 0; // the first point that is not finite
  while (first < xs.length && isFinite(first)) first += 1;
  if (first === xs.length) return columns;
  const keep = Array.from({ length: first }, (_, i) => i);
  for (let i = first; i < xs.length; i += 1) if (isFinite(i)) keep.push(i);
  return new Map([...columns].map(([name, values]) => [name, values.constructor.from(keep, (i) => values[i])]));
}

const WRITERS = { FlatColor: flat, RGB8: packedColours, MONO8: packedColours, RGBF32: floatColours, Intensity: intensities };
