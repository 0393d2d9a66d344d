// The hub of a tab in Node.js: reads orders from stdin and prints events, as lines of JSON: node tab.mjs FILES
// Orders: {"start": program, "as": number}, {"interrupt": number}, {"stop": number}, {"type": number, "typed"}, {"write": path, "text"}, {"read": path}.
// Events: {"number", "output"}, {"number", "code"}, or {"path", "text"}.

import { readFile } from "node:fs/promises";
import path from "node:path";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";
import { isMainThread, parentPort, Worker, workerData } from "node:worker_threads";

import { start } from "../../../../docs/in-browser/start.mjs";
import { Hub } from "../../src/pipros_tab/page/hub.mjs";
import { runProcess } from "../../src/pipros_tab/page/process.mjs";

if (isMainThread) {
  const files = process.argv[2];
  const hub = new Hub((data, onMessage) => {
    const worker = new Worker(new URL(import.meta.url), { workerData: { ...data, files } });
    worker.on("message", onMessage);
    worker.on("error", (error) => onMessage({ output: `${error.stack}\n` }));
    return worker;
  });
  const tell = (event) => console.log(JSON.stringify(event));
  const started = new Map();
  for await (const line of createInterface({ input: process.stdin })) {
    const order = JSON.parse(line);
    if (order.start) {
      const process = hub.start(order.start, (output) => tell({ number: order.as, output }));
      started.set(order.as, process);
      process.ended.then((code) => tell({ number: order.as, code }));
    } else if (order.interrupt) hub.interrupt(started.get(order.interrupt));
    else if (order.type) hub.type(started.get(order.type), order.typed);
    else if (order.write) hub.writeFile(order.write, new TextEncoder().encode(order.text));
    else if (order.read) tell({ path: order.read, text: new TextDecoder().decode(hub.files.get(order.read)?.[1]) });
    else hub.stop(started.get(order.stop));
  }
  process.exit();
} else {
  const { files } = workerData;
  const { loadPyodide } = await import(pathToFileURL(path.join(files, "pyodide.mjs")).href);
  const read = async (name) => new Uint8Array(await readFile(path.join(files, name)));
  const program = new Promise((resolve) => parentPort.once("message", resolve));
  const load = (options) => loadPyodide({ indexURL: `${files}/`, ...options });
  await runProcess(workerData, program, (message) => parentPort.postMessage(message), load, (options) => start(load, read, options), async () => null);
}
