// Runs each program of a JSON file in Pyodide, in a separate folder, and prints the error and output of each by name, as JSON:
// node run.mjs FILES PROGRAMS.json

import { readFile } from "node:fs/promises";
import path from "node:path";
import { pathToFileURL } from "node:url";

import { start } from "../../../../docs/in-browser/start.mjs";

const [files, programs] = process.argv.slice(2);
const read = async (name) => new Uint8Array(await readFile(path.join(files, name)));
const { loadPyodide } = await import(pathToFileURL(path.join(files, "pyodide.mjs")).href);
const printed = [];
const pyodide = await start(loadPyodide, read, {
  indexURL: `${files}/`,
  stdout: (line) => printed.push(line),
  stderr: (line) => printed.push(line),
});
const results = {};
for (const [number, [name, source]] of Object.entries(JSON.parse(await readFile(programs, "utf8"))).entries()) {
  pyodide.runPython(`import os; os.mkdir("/home/${number}"); os.chdir("/home/${number}")`);
  let error = "";
  try {
    await pyodide.runPythonAsync(source, { globals: pyodide.toPy({ __name__: "__main__" }) });
  } catch (failure) {
    error = failure.message;
  }
  results[name] = { error, printed: printed.splice(0) };
}
console.log(JSON.stringify(results));
