// A worker of the page: starts Python, and runs the program that the hub sends.

import { packed, unpacked } from "./image.mjs";
import { runProcess } from "./process.mjs";
import { start } from "./start.mjs";

const FILES = new URL("files/", import.meta.url);
const MADE_FROM = ["pyodide-lock.json", "pipros.whl", "libraries.zip"];

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
  const program = new Promise((resolve) => (self.onmessage = (message) => resolve(message.data)));
  const load = async (options) => {
    const { loadPyodide } = await import(new URL("pyodide.mjs", FILES).href);
    return loadPyodide({ indexURL: FILES.href, ...options });
  };
  void runProcess(data, program, (message) => self.postMessage(message), load, (options) => start(load, read, options), openImages);
};
