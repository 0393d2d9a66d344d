// Colours for numbers in pictures: depths, and 16-bit brightness.

import { rainbow } from "./scene/colours.js";

// By name, the functions that write the colour of a number from 0 (low) to 1 (high).
const MAPS = {
  grey: (part, out, at) => out.fill(Math.round(part * 255), at, at + 3),
  rainbow,
  heat(part, out, at) {
    for (let channel = 0; channel < 3; channel += 1) out[at + channel] = Math.round(255 * Math.min(1, Math.max(0, part * 3 - channel)));
  },
};

export const COLOUR_MAPS = Object.keys(MAPS);

// Returns RGB of the 256 shades of a colour map.
export function paletteOf(name) {
  const out = new Uint8Array(256 * 3);
  for (let shade = 0; shade < 256; shade += 1) MAPS[name](shade / 255, out, shade * 3);
  return out;
}

// Returns the text of a number in a picture: metres or the plain number.
export const numberText = (value, isMetres) => (Number.isFinite(value) ? `${Number(value.toPrecision(6))}${isMetres ? " m" : ""}`
  : String(value));

// Returns why the messages of a topic are not decoded, and what to do: one line; empty if they are. The type may be the format of a
// CompressedImage.
export function unsupportedTransport({ name, type }) {
  const transport = /theora/i.test(type) ? "theora" : /[hx]26[45]|hevc|CompressedVideo/i.test(type) ? "h264" : "";
  if (!transport) return "";
  const base = name.replace(/\/(theora|[hx]26[45]|hevc|compressed)$/, "");
  return `The transport ${transport} is not decoded here. To see it, run: rosrun image_transport republish ${transport} in:=${base} raw ` +
    `out:=${base}/republished`;
}
