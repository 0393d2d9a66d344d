// Starts Python with pipros from a folder that plugins/pipros-tab/tests/support/pyodide_files.py has written.
// Used by the worker and by packages/pipros/tests/pyodide.

/**
 * @param {(options: object) => Promise<any>} loadPyodide
 * @param {(name: string) => Promise<Uint8Array>} read returns the content of a file of the folder
 * @param {object} options for Pyodide
 */
export async function start(loadPyodide, read, options) {
  const pyodide = await loadPyodide(options);
  const extractDir = pyodide.runPython("import site; site.getsitepackages()[0]");
  pyodide.unpackArchive(await read("pipros.whl"), "wheel", { extractDir });
  pyodide.unpackArchive(await read("libraries.zip"), "zip", { extractDir });
  // Python reads pipros.pth only when it starts; at that time the file did not exist yet.
  pyodide.runPython("import pipros.startup");
  return pyodide;
}
