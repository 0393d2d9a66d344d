// rviz's colours: of texts in files, of numbers (rainbow), of cells in maps. Channels are 0 to 255.

// Returns `[r, g, b]` of "r; g; b" or "#rrggbb"; `fallback` if the text is neither.
export function parsedColour(text, fallback = [255, 255, 255]) {
  const hex = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(text.trim());
  if (hex) return hex.slice(1).map((part) => parseInt(part, 16));
  const parts = text.split(/[;,]/).slice(0, 3).map((part) => Number(part));
  if (parts.length < 3 || !parts.every(Number.isFinite)) return fallback;
  return parts.map((part) => Math.min(255, Math.max(0, Math.round(part))));
}

export const colourText = (colour) => colour.join("; ");
export const hexOf = (colour) => `#${colour.map((part) => part.toString(16).padStart(2, "0")).join("")}`;

// Writes the rainbow's colour of a value from 0 to 1 (the fraction between minimum and maximum): red, yellow, green,
// cyan, blue, magenta. NaN is blue, as in rviz.
export function rainbow(fraction, out, at) {
  if (Number.isNaN(fraction)) {
    out.set([0, 0, 255], at);
    return;
  }
  const h = Math.min(1, Math.max(0, 1 - fraction)) * 5 + 1;
  const i = Math.floor(h);
  const f = i % 2 ? h - i : 1 - (h - i);
  const n = Math.round((1 - f) * 255);
  out[at] = i <= 1 || i === 4 ? n : i >= 5 ? 255 : 0;
  out[at + 1] = i <= 1 ? 0 : i === 2 || i >= 5 ? n : 255;
  out[at + 2] = i <= 2 ? 255 : i === 3 ? n : 0;
}

// Returns RGBA of the 256 values of a cell, for the schemes map, costmap and raw.
export function mapPalette(scheme) {
  const out = new Uint8Array(1024);
  for (let v = 0; v < 256; v += 1) out.set(cellColour(scheme, v), v * 4);
  return out;
}

function cellColour(scheme, v) {
  if (scheme === "raw") return [v, v, v, 255];
  if (scheme === "costmap") {
    const red = Math.floor((255 * v) / 100);
    if (v === 0) return [0, 0, 0, 0];
    if (v <= 98) return [red, 0, 255 - red, 255];
    if (v === 99) return [0, 255, 255, 255];
    if (v === 100) return [255, 0, 255, 255];
  }
  if (v <= 100) {
    const grey = 255 - Math.floor((255 * v) / 100);
    return [grey, grey, grey, 255];
  }
  if (v <= 127) return [0, 255, 0, 255];
  if (v <= 254) return [255, Math.floor((255 * (v - 128)) / 126), 0, 255];
  return [112, 137, 134, 255];
}
