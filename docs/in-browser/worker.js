// Runs the Python of the page in a thread of its own, so that the page stays usable and can end it.
//
// Requests: {run: source} and {save: name, content: ArrayBuffer}. Replies: {output: text} while a program runs,
// {done: true} after it, and {failed: text} if Python cannot be started.

import { start } from "./start.mjs";

const FILES = new URL("files/", import.meta.url);
const PYODIDE_FRAMES = / {2}File "\/lib\/python\d+\.zip\/_pyodide[^]*?(?= {2}File "<exec>")/;
const print = (text) => self.postMessage({ output: `${text}\n` });

async function read(name) {
  const response = await fetch(new URL(name, FILES));
  if (!response.ok) throw new Error(`${name}: ${response.status} ${response.statusText}`);
  return new Uint8Array(await response.arrayBuffer());
}

async function load() {
  const { loadPyodide } = await import(new URL("pyodide.mjs", FILES).href);
  return start(loadPyodide, read, { indexURL: FILES.href, stdout: print, stderr: print });
}

const started = load();
started.catch((error) => self.postMessage({ failed: String(error.message ?? error) }));

self.onmessage = async ({ data }) => {
  const pyodide = await started;
  if (data.save) {
    pyodide.FS.writeFile(data.save, new Uint8Array(data.content));
  } else {
    try {
      await pyodide.runPythonAsync(data.run);
    } catch (error) {
      print(error.message.replace(PYODIDE_FRAMES, "").trimEnd());
    }
    self.postMessage({ done: true });
  }
};
