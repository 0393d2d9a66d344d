// The pages of programs, such as rqt_graph and turtlesim, in frames beside the terminals.
// The frame requests files through the service worker, which asks this page, and this page the program that listens at the port.

import { PortSocket, requestFile } from "./connection.mjs";

/** The address that a program prints: its name, its port, and the token and the view. */
const ADDRESS = /([\w./-]+): http:\/\/localhost:(\d+)\/(#\S+)/;

export class Pictures {
  #id = crypto.randomUUID();
  /** @type {Map<number, {frame: any, choice: HTMLElement}>} by port */
  #shown = new Map();

  /**
   * @param {import("./hub.mjs").Hub} hub
   * @param {HTMLElement} side holds the files and the frames
   * @param {HTMLElement} choices holds a button for each of them
   */
  constructor(hub, side, choices) {
    this.hub = hub;
    this.side = side;
    this.choices = choices;
    this.files = this.#choice("Files", () => this.show(null));
    hub.onClosedPort = (port) => this.close(port);
    navigator.serviceWorker?.addEventListener("message", (event) => this.#answer(event));
    this.show(null);
  }

  /** Shows the page of a program whose address a line contains. Returns whether it does. */
  open(line) {
    const [, name, text, place] = ADDRESS.exec(line) ?? [];
    const port = Number(text);
    if (!name || !this.hub.listens(port)) return false;
    if (!this.#shown.has(port)) void this.#load(port, name, place);
    else this.show(port);
    return true;
  }

  close(port) {
    const shown = this.#shown.get(port);
    if (!shown) return;
    this.#shown.delete(port);
    const wasSeen = !shown.frame.hidden;
    shown.frame.remove();
    shown.choice.remove();
    if (wasSeen) this.show(null);
    else this.choices.hidden = this.#shown.size === 0;
  }

  /** Shows the page at a port, or the files. */
  show(port) {
    const workspace = /** @type {HTMLElement} */ (this.side.firstElementChild);
    workspace.hidden = port !== null;
    this.files.ariaPressed = String(port === null);
    for (const [each, { frame, choice }] of this.#shown) {
      frame.hidden = each !== port;
      choice.ariaPressed = String(each === port);
    }
    this.choices.hidden = this.#shown.size === 0;
  }

  async #load(port, name, place) {
    const frame = Object.assign(document.createElement("iframe"), { title: name });
    const choice = this.#choice(name, () => this.show(port));
    this.#shown.set(port, { frame, choice });
    Object.assign(frame, {
      connect: () => {
        const connection = this.hub.connect(port);
        return connection && new PortSocket(connection, port, frame.contentWindow);
      },
    });
    this.show(port);
    await navigator.serviceWorker.ready;
    frame.src = `port/${this.#id}/${port}/${place}`;
    this.side.append(frame);
  }

  #choice(name, onclick) {
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: name, onclick });
    this.choices.append(button);
    return button;
  }

  /** Answers the service worker: `{id, port, path}`, with a port for the answer. */
  async #answer(event) {
    const { id, port, path } = event.data;
    if (id !== this.#id) return;
    const connection = this.hub.connect(port);
    try {
      if (!connection) throw new Error(`no program listens at port ${port}`);
      event.ports[0].postMessage(await requestFile(connection, port, path));
    } catch (error) {
      const body = new TextEncoder().encode(error.message);
      event.ports[0].postMessage({ status: 502, headers: [["Content-Type", "text/plain"]], body });
    }
  }
}
