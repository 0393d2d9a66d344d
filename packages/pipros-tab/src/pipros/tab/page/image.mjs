// The image of a prepared Python: its memory, and the files of its libraries. Workers start from it much sooner than from archives.

const LIBRARIES = "/lib/python3.14/site-packages";

/**
 * Both are shared by all workers, which do not change them.
 * @typedef {{memory: Uint8Array, files: [string, number, Uint8Array | null][]}} Image path, mode and content; folders have no content
 */

/** @returns {Image} */
export function imageOf(pyodide) {
  /** @type {Image["files"]} */
  const files = [];
  const add = (path) => {
    const { mode } = pyodide.FS.stat(path);
    if (!pyodide.FS.isDir(mode)) {
      files.push([path, mode, pyodide.FS.readFile(path)]);
      return;
    }
    files.push([path, mode, null]);
    for (const name of pyodide.FS.readdir(path)) if (name !== "." && name !== "..") add(`${path}/${name}`);
  };
  add(LIBRARIES);
  const contents = shared(files.map(([, , content]) => content ?? new Uint8Array(0)));
  const [memory] = shared([pyodide.makeMemorySnapshot()]);
  return { memory, files: files.map(([path, mode, content], at) => [path, mode, content && contents[at]]) };
}

/** Starts Python from an image. */
export async function startFrom(image, loadPyodide) {
  const memory = image.memory.slice(); // browsers decode no text in shared memory
  const pyodide = await loadPyodide({ _loadSnapshot: memory });
  delete pyodide._api.config._loadSnapshot; // it would keep the copy
  for (const [path, mode, content] of image.files) {
    if (content) pyodide.FS.writeFile(path, content, { canOwn: true, mode });
    else pyodide.FS.mkdirTree(path);
  }
  return pyodide;
}

/** Copies arrays of bytes into one piece of shared memory; returns views of it. */
function shared(arrays) {
  const bytes = new Uint8Array(new SharedArrayBuffer(arrays.reduce((size, array) => size + array.length, 0)));
  let at = 0;
  return arrays.map((array) => {
    bytes.set(array, at);
    at += array.length;
    return bytes.subarray(at - array.length, at);
  });
}
