// A worker of the page: starts Python, and runs the program that the hub sends.

import { packed, unpacked } from "./image.mjs";
import { runProcess } from "./process.mjs";
import { start } from "./start.mjs";

const FILES = new URL("files/", import.meta.url);
const MADE_FROM = ["pyodide-lock.json", "pipros.whl", "libraries.zip"];

/** Says how much of Python has arrived: `fetch` counts the bytes of every answer, as unpacked by the browser. */
function countFetched() {
  const { fetch } = self;
  let bytes = 0;
  let said = 0;
  self.fetch = async (...request) => {
    const response = await fetch(...request);
    const counted = new TransformStream({
      transform(piece, controller) {
        bytes += piece.length;
        if (bytes - said > 500_000) {
          said = bytes;
          self.postMessage({ output: `Starting Python: ${(bytes / 1e6).toFixed(1)} MB have arrived, unpacked …\r` });
        }
        controller.enqueue(piece);
      },
    });
    return new Response(response.body?.pipeThrough(counted), response);
  };
}

async function read(name) {
  const response = await fetch(new URL(name, FILES));
  if (!response.ok) throw new Error(`${name}: ${response.status} ${response.statusText}`);
  return new Uint8Array(await response.arrayBuffer());
}

/** Opens the browser's cache, which keeps the image for later visits. Another browser, or other files, need another image. */
async function openImages() {
  const cache = await caches.open("pipros-tab-image");
  const parts = new Blob([navigator.userAgent, ...(await Promise.all(MADE_FROM.map(read)))]);
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", await parts.arrayBuffer()));
  const place = new URL(`image/${digest.join("-")}`, FILES);
  return {
    async read() {
      const kept = await cache.match(place);
      return kept && unpacked(new Uint8Array(await kept.arrayBuffer()));
    },
    async write(image) {
      for (const old of await cache.keys()) await cache.delete(old);
      await cache.put(place, new Response(packed(image)));
    },
  };
}

self.onmessage = ({ data }) => {
  if (data.makesImage) countFetched();
  const program = new Promise((resolve) => (self.onmessage = (message) => resolve(message.data)));
  const load = async (options) => {
    const { loadPyodide } = await import(new URL("pyodide.mjs", FILES).href);
    return loadPyodide({ indexURL: FILES.href, ...options });
  };
  void runProcess(data, program, (message) => self.postMessage(message), load, (options) => start(load, read, options), openImages);
};
