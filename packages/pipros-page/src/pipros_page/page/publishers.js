// The publishers that run in this page: started in Publish, listed and stopped there and in the head of the page.

import { h } from "./dom.js";
import { live } from "./live.js";

const running = new Set(); // {args, count, stop}
const changes = new EventTarget();

// Publishes until `stop()`, or until the server refuses: then calls `onError(text)`. A message that is published once is
// not published again when a lost connection is restored: it may be an old goal.
export function startPublisher(args, onError) {
  const publisher = { args, count: 0, stop: () => end() };
  const lost = new AbortController();
  const close = live.watch("publishing", args, (data) => {
    publisher.count = data.count;
    changes.dispatchEvent(new Event("count"));
  }, (problem) => {
    end();
    onError(problem);
  });
  if (!args.rate) {
    live.addEventListener("state", () => {
      if (live.isOpen) return;
      end();
      onError("The connection to the server was lost, so the message is no longer published.");
    }, { signal: lost.signal });
  }
  function end() {
    lost.abort();
    close();
    running.delete(publisher);
    changes.dispatchEvent(new Event("change"));
  }
  running.add(publisher);
  changes.dispatchEvent(new Event("change"));
}

// Calls `draw(number)` now and whenever publishers are started or stopped.
export function onPublishers(draw, signal) {
  changes.addEventListener("change", () => draw(running.size), { signal });
  draw(running.size);
}

// Returns a list of all publishers with buttons to stop them.
export function publisherList(signal) {
  const element = h("div", {});
  const rows = new Map(); // publisher to {row, count}
  const count = () => { for (const [publisher, row] of rows) row.count.textContent = String(publisher.count); };
  onPublishers(() => {
    for (const [publisher, { row }] of rows) {
      if (running.has(publisher)) continue;
      row.remove();
      rows.delete(publisher);
    }
    for (const publisher of running) {
      if (rows.has(publisher)) continue;
      rows.set(publisher, rowOf(publisher));
      element.append(rows.get(publisher).row);
    }
    count();
  }, signal);
  changes.addEventListener("count", count, { signal });
  return element;
}

function rowOf({ args, stop }) {
  const count = h("span", {});
  const row = h("p", {}, `${args.name} (${args.type}), ${args.rate ? `${args.rate} Hz` : "once"}: `, count, " ",
    h("button", { "aria-label": `Stop publishing ${args.name}`, onclick: stop }, "Stop"));
  return { row, count };
}
