// The image of a prepared Python: its memory, and the files of its libraries. Workers start from it much sooner than from archives.

import { joined } from "./packets.mjs";

const LIBRARIES = "/lib/python3.14/site-packages";
const NEW_LINE = 10;

/**
 * Path, mode and size of each file; folders have no size. All workers share the contents and the memory, and do not change them.
 * @typedef {{files: [string, number, number | null][], contents: Uint8Array, memory: Uint8Array}} Image
 */

/** @returns {Image} */
export function imageOf(pyodide) {
  /** @type {Image["files"]} */
  const files = [];
  const contents = [];
  const add = (path) => {
    const { mode } = pyodide.FS.stat(path);
    const isFolder = pyodide.FS.isDir(mode);
    if (!isFolder) contents.push(pyodide.FS.readFile(path));
    files.push([path, mode, isFolder ? null : contents.at(-1).length]);
    if (isFolder) for (const name of pyodide.FS.readdir(path)) if (name !== "." && name !== "..") add(`${path}/${name}`);
  };
  add(LIBRARIES);
  return { files, contents: shared(contents), memory: shared([pyodide.makeMemorySnapshot()]) };
}

/** Starts Python from an image. */
export async function startFrom({ files, contents, memory }, loadPyodide) {
  const pyodide = await loadPyodide({ _loadSnapshot: memory.slice() }); // browsers decode no text in shared memory
  delete pyodide._api.config._loadSnapshot; // it would keep the copy
  let at = 0;
  for (const [path, mode, size] of files) {
    if (size === null) pyodide.FS.mkdirTree(path);
    else pyodide.FS.writeFile(path, contents.subarray(at, (at += size)), { canOwn: true, mode });
  }
  return pyodide;
}

/** Returns an image as bytes that are not shared, so that they can be kept. */
export function packed({ files, contents, memory }) {
  return new Blob([JSON.stringify({ files, memoryBytes: memory.length }), "\n", memory.slice(), contents.slice()]);
}

/** Returns the image in these bytes. @param {Uint8Array} bytes @returns {Image} */
export function unpacked(bytes) {
  const end = bytes.indexOf(NEW_LINE);
  const { files, memoryBytes } = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  const both = shared([bytes.subarray(end + 1)]);
  return { files, memory: both.subarray(0, memoryBytes), contents: both.subarray(memoryBytes) };
}

const shared = (arrays) => joined(arrays, SharedArrayBuffer);
