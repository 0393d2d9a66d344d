// Reads PNG files with 16-bit grey values, of which browsers keep only the 8 most significant bits.

const SIGNATURE_BYTES = 8;
const MAX_PIXELS = 2 ** 24;
const BYTES = 2; // number of bytes per pixel

// Returns {width, height, values}. With `quantised`, the quotient and offset of inverse depths, values are metres or NaN.
export async function depthOf(png, quantised) {
  const { width, height, data } = partsOf(png);
  const row = width * BYTES + 1;
  const rows = await inflated(data, row * height);
  const values = new Float64Array(width * height);
  let above = new Uint8Array(row - 1);
  for (let y = 0; y < height; y += 1) {
    const line = rows.subarray(y * row + 1, (y + 1) * row);
    unfilter(rows[y * row], line, above);
    for (let x = 0; x < width; x += 1) values[y * width + x] = line[x * BYTES] * 256 + line[x * BYTES + 1];
    above = line;
  }
  if (!quantised) return { width, height, values };
  const [quotient, offset] = quantised;
  return { width, height, values: values.map((step) => (step ? quotient / (step - offset) : NaN)) };
}

function partsOf(png) {
  const view = new DataView(png.buffer, png.byteOffset, png.byteLength);
  const data = [];
  let [width, height] = [0, 0];
  for (let at = SIGNATURE_BYTES; at + 12 <= png.length; at += view.getUint32(at) + 12) {
    const name = String.fromCharCode(...png.subarray(at + 4, at + 8));
    if (name === "IHDR") {
      [width, height] = [view.getUint32(at + 8), view.getUint32(at + 12)];
      const [bits, colour, , , interlace] = png.subarray(at + 16, at + 21);
      if (bits !== 16 || colour !== 0 || interlace !== 0) throw new Error("a depth image must have 16-bit grey values, not interlaced");
      if (width * height > MAX_PIXELS) throw new Error(`${width} × ${height} pixels; the limit is ${MAX_PIXELS}`);
    } else if (name === "IDAT") data.push(png.slice(at + 8, at + 8 + view.getUint32(at)));
  }
  if (!width || !height) throw new Error("the PNG has no size");
  return { width, height, data };
}

// Inflates parts to exactly `size` bytes; reads no more, whatever they contain.
async function inflated(parts, size) {
  const reader = new Blob(parts).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
  const out = new Uint8Array(size);
  let end = 0;
  while (end < size) {
    const { done, value } = await reader.read();
    if (done) throw new Error("the PNG is incomplete");
    out.set(value.subarray(0, size - end), end);
    end += value.length;
  }
  reader.cancel().catch(() => {});
  return out;
}

// Undoes the filter of a row in place (PNG specification, section 9).
function unfilter(kind, line, above) {
  for (let i = 0; i < line.length; i += 1) {
    const left = i < BYTES ? 0 : line[i - BYTES];
    const corner = i < BYTES ? 0 : above[i - BYTES];
    line[i] += [0, left, above[i], (left + above[i]) >> 1, paeth(left, above[i], corner)][kind] ?? 0;
  }
}

function paeth(left, up, corner) {
  const guess = left + up - corner;
  const [a, b, c] = [Math.abs(guess - left), Math.abs(guess - up), Math.abs(guess - corner)];
  if (a <= b && a <= c) return left;
  return b <= c ? up : corner;
}
