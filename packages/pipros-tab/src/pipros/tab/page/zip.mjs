// Writes and reads zip archives. Written files are not compressed; those of other programs may be (method 8, deflate).

const LOCAL = 0x04034b50;
const CENTRAL = 0x02014b50;
const END = 0x06054b50;
const UTF8 = 0x800;
const UNIX = 0x0314;
const IS_FOLDER = 0o040000;
const IS_FILE = 0o100000;
const TYPES = 0o170000;
const MOST_BYTES = 256 * 2 ** 20;
const ODD_NAME = /^\/|\/\/|(^|\/)\.{1,2}(\/|$)|[\p{Cc}\\]|^$/u; // outside of the folder, or not the name of a file

const TABLE = Uint32Array.from({ length: 256 }, (_, index) => {
  let value = index;
  for (let bit = 0; bit < 8; bit++) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value;
});

function checksum(bytes) {
  let value = ~0;
  for (const byte of bytes) value = TABLE[(value ^ byte) & 255] ^ (value >>> 8);
  return ~value >>> 0;
}

function record(size, fields) {
  const view = new DataView(new ArrayBuffer(size));
  for (const [at, bytes, value] of fields) bytes === 2 ? view.setUint16(at, value, true) : view.setUint32(at, value, true);
  return new Uint8Array(view.buffer);
}

/** @param {Map<string, [number, Uint8Array<ArrayBuffer>]>} files mode and content, by name @returns {Blob} */
export function zipOf(files) {
  const parts = [];
  const heads = [];
  let at = 0;
  let headBytes = 0;
  for (const [path, [mode, content]] of files) {
    const isFolder = Boolean(mode & IS_FOLDER);
    const name = new TextEncoder().encode(isFolder ? `${path}/` : path);
    const about = [[6, 2, UTF8], [14, 4, checksum(content)], [18, 4, content.length], [22, 4, content.length], [26, 2, name.length]];
    const local = record(30, [[0, 4, LOCAL], [4, 2, 20], ...about]);
    const unixMode = mode & TYPES ? mode : mode | IS_FILE;
    const moved = about.map(([place, bytes, value]) => [place + 2, bytes, value]);
    const central = record(46, [[0, 4, CENTRAL], [4, 2, UNIX], [6, 2, 20], ...moved, [38, 4, unixMode * 0x10000], [42, 4, at]]);
    parts.push(local, name, content);
    heads.push(central, name);
    at += local.length + name.length + content.length;
    headBytes += central.length + name.length;
  }
  const end = record(22, [[0, 4, END], [8, 2, files.size], [10, 2, files.size], [12, 4, headBytes], [16, 4, at]]);
  return new Blob([...parts, ...heads, end], { type: "application/zip" });
}

/** Reads what can be read, at most `most` bytes. An entry that is compressed by another method, is damaged or has an odd name is left
 * out alone. Throws an error if it is not a zip archive, or too large.
 * @returns {Promise<{files: Map<string, [number, Uint8Array]>, leftOut: string[]}>} */
export async function filesOf(bytes, most = MOST_BYTES) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  let end = bytes.length - 22;
  while (end >= 0 && view.getUint32(end, true) !== END) end--;
  if (end < 0) throw new Error("this file is not a zip archive");
  const files = new Map();
  const leftOut = [];
  let at = view.getUint32(end + 16, true);
  for (let count = view.getUint16(end + 10, true); count > 0 && at + 46 <= bytes.length; count--) {
    const nameBytes = view.getUint16(at + 28, true);
    const path = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + nameBytes));
    const mode = view.getUint16(at + 40, true) || (path.endsWith("/") ? IS_FOLDER | 0o755 : 0o644);
    try {
      if (ODD_NAME.test(path)) throw new Error("its name is refused");
      const local = view.getUint32(at + 42, true);
      const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
      const packed = bytes.subarray(start, start + view.getUint32(at + 20, true));
      const content = await unpacked(packed, view.getUint16(at + 10, true), most);
      if (checksum(content) !== view.getUint32(at + 16, true)) throw new Error("it is damaged");
      most -= content.length;
      files.set(path.replace(/\/$/, ""), [mode, content]);
    } catch (error) {
      if (error instanceof TooLarge) throw error;
      leftOut.push(`${path}: ${error.message}`);
    }
    at += 46 + nameBytes + view.getUint16(at + 30, true) + view.getUint16(at + 32, true);
  }
  return { files, leftOut };
}

class TooLarge extends Error {}

async function unpacked(packed, method, most) {
  if (method !== 0 && method !== 8) throw new Error(`it is compressed by the unknown method ${method}`);
  const stream = new Blob([packed]).stream();
  const reader = (method ? stream.pipeThrough(new DecompressionStream("deflate-raw")) : stream).getReader();
  const parts = [];
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    most -= part.value.length;
    if (most < 0) {
      await reader.cancel();
      throw new TooLarge("the files of this archive are too large for a tab");
    }
    parts.push(part.value);
  }
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}
