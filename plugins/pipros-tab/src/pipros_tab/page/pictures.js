// The pages of programs, such as rqt_graph and turtlesim, in frames beside the terminals.
// The frame requests files through the service worker, which asks this page, and this page the program that listens at the port.

import { PortSocket, Requests } from "./connection.mjs";
import { h } from "./dom.js";

/** The address that a program prints: its name, its port, and the token and the view. */
const ADDRESS = /(?<![\w./-])([\w./-]+): http:\/\/localhost:(\d+)\/(#\S+)/;

export class Pictures {
  #id = crypto.randomUUID();
  /** What the buttons show: files, steps, and the pages of programs by port. @type {Map<string | number, {part: any, choice: any}>} */
  #parts = new Map();

  /**
   * @param {import("./hub.mjs").Hub} hub
   * @param {any} side holds the files, the steps and the frames
   * @param {HTMLElement} choices holds a button for each of them
   */
  constructor(hub, side, choices) {
    this.hub = hub;
    this.requests = new Requests((port) => hub.connect(port));
    this.side = side;
    this.choices = choices;
    this.#add("files", side.querySelector("#workspace"), "Files");
    this.#add("steps", side.querySelector("#steps"), "Steps");
    hub.onClosedPort = (port) => this.close(port);
    navigator.serviceWorker?.addEventListener("message", (event) => this.#answer(event));
    this.show("files");
  }

  /** Shows the page of a program whose address a line contains, if it does. */
  open(line) {
    const [, name, text, place] = ADDRESS.exec(line) ?? [];
    const port = Number(text);
    if (!name || !this.hub.listens(port)) return;
    if (!this.#parts.has(port)) void this.#load(port, name, place);
    this.show(port);
  }

  close(port) {
    const { part, choice } = this.#parts.get(port) ?? {};
    if (!this.#parts.delete(port)) return;
    part.remove();
    choice.remove();
    if (!part.hidden) this.show("files");
  }

  /** Shows the page at a port, the files or the steps. */
  show(key) {
    for (const [each, { part, choice }] of this.#parts) {
      part.hidden = each !== key;
      choice.ariaPressed = String(each === key);
    }
  }

  #add(key, part, name) {
    const choice = h("button", { type: "button", onclick: () => this.show(key) }, name);
    this.#parts.set(key, { part, choice });
    this.choices.append(choice);
    this.side.append(part);
  }

  async #load(port, name, place) {
    const frame = h("iframe", { title: name });
    const again = h("button", { type: "button", onclick: () => {
      failed.hidden = true;
      frame.contentWindow.location.reload();
    } }, "Try again");
    const failed = h("p", { class: "failed", role: "alert", hidden: true }, `${name} did not answer. `, again);
    frame.connect = () => {
      const connection = this.hub.connect(port);
      return connection && new PortSocket(connection, port, frame.contentWindow);
    };
    const part = h("section", { class: "page" }, failed);
    this.#add(port, part, name);
    await navigator.serviceWorker.ready;
    frame.src = `port/${this.#id}/${port}/${place}`;
    part.append(frame);
  }

  /** Answers the service worker: `{id, port, path}`, with a port for the answer. */
  async #answer(event) {
    const { id, port, path } = event.data;
    if (id !== this.#id) return;
    try {
      event.ports[0].postMessage(await this.requests.get(port, path));
    } catch (error) {
      const failed = this.#parts.get(port)?.part.querySelector(".failed");
      if (failed) failed.hidden = false; // the frame may stay white
      const body = new TextEncoder().encode(error.message);
      event.ports[0].postMessage({ status: 502, headers: [["Content-Type", "text/plain"]], body });
    }
  }
}
