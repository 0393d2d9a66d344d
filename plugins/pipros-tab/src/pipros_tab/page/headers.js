// A service worker: adds the headers without which browsers share no memory among workers, and keeps files for later visits.
// It also asks the page for the files of programs that serve a page: port/PAGE/PORT/FILE.

const KEPT = "pipros-tab";
const HEADERS = {
  "Cross-Origin-Opener-Policy": "same-origin",
  "Cross-Origin-Embedder-Policy": "require-corp",
  "Cross-Origin-Resource-Policy": "same-origin",
};

const OF_PROGRAM = /^port\/([\w-]+)\/(\d+)(\/[^?#]*)/;

const worker = /** @type {any} */ (self); // TypeScript takes it for a window

worker.addEventListener("install", () => worker.skipWaiting());
worker.addEventListener("activate", (event) => event.waitUntil(worker.clients.claim()));
worker.addEventListener("fetch", (event) => {
  const { request } = event;
  if (request.method !== "GET" || new URL(request.url).origin !== self.location.origin) return;
  const [, id, port, path] = OF_PROGRAM.exec(request.url.slice(worker.registration.scope.length)) ?? [];
  event.respondWith(id ? answerOfProgram({ id, port: Number(port), path }) : answer(request));
});

/** Asks all pages; the one that has made the frame answers. */
async function answerOfProgram(wanted) {
  const pages = await worker.clients.matchAll({ type: "window" });
  const { status, headers, body } = await Promise.race(
    pages.map((page) => {
      const channel = new MessageChannel();
      page.postMessage(wanted, [channel.port2]);
      return new Promise((resolve) => (channel.port1.onmessage = (event) => resolve(event.data)));
    }),
  );
  return isolated(body, status, "", headers);
}

async function answer(request) {
  const kept = await caches.open(KEPT);
  let response;
  try {
    response = await fetch(request);
    if (response.ok && !isSame(response, await kept.match(request))) await kept.put(request, response.clone());
  } catch (error) {
    response = await kept.match(request);
    if (!response) throw error;
  }
  return isolated(response.body, response.status, response.statusText, response.headers);
}

function isSame(response, kept) {
  const [now, before] = [response, kept].map((each) => each?.headers.get("ETag") ?? each?.headers.get("Last-Modified"));
  return now && now === before;
}

function isolated(body, status, statusText, given) {
  const headers = new Headers(given);
  headers.delete("Content-Security-Policy"); // that of a program's page forbids frames
  for (const [name, value] of Object.entries(HEADERS)) headers.set(name, value);
  return new Response(body, { status, statusText, headers });
}
