// A worker of the page: starts Python, and runs the program that the hub sends.

import { runProcess } from "./process.mjs";
import { start } from "./start.mjs";

const FILES = new URL("files/", import.meta.url);

async function read(name) {
  const response = await fetch(new URL(name, FILES));
  if (!response.ok) throw new Error(`${name}: ${response.status} ${response.statusText}`);
  return new Uint8Array(await response.arrayBuffer());
}

self.onmessage = ({ data }) => {
  const program = new Promise((resolve) => (self.onmessage = (message) => resolve(message.data)));
  const load = async (options) => {
    const { loadPyodide } = await import(new URL("pyodide.mjs", FILES).href);
    return loadPyodide({ indexURL: FILES.href, ...options });
  };
  void runProcess(data, program, (message) => self.postMessage(message), load, (options) => start(load, read, options));
};
