// The hub of a tab: starts and ends workers, which run one Python program each, and connects them.
// It runs where the page runs, never waits, and knows nothing of ROS: it passes bytes between ports, and files between workers.

import { Connection } from "./connection.mjs";
import { bytesOf, filePackets, joined, Kind, NOTHING, numberIn } from "./packets.mjs";
import { eachPacket, Ring, RING_BYTES } from "./ring.mjs";

const SIGKILL = 9;
const STOPPED = 137;
const NEXT_SPARE_MS = 300; // a program that has just started needs the processor more than a spare worker
const FIRST_PORT = 20_000;
const LAST_PORT = 59_999;
const FIRST_ACCEPTED = 0x80000000; // numbers of ends that workers accept; they number the others from 1
const SIGINT = 2; // Pyodide's interrupt buffer has the number of the signal
const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** @typedef {{terminate: () => unknown, postMessage: (message: unknown) => void}} Worker_ */

/** One program in a worker; `parent` and `children` are those that it was started by, and has started. */
class Process {
  /** @type {Worker_ | null} null until there is an image */ worker = null;
  /** @type {object | null} */ program = null;
  /** @type {Process | null} */ parent = null;
  /** @type {Set<Process>} */ children = new Set();
  toHub = new Ring();
  fromHub = new Ring();
  /** A signal's number, and how many characters of output are not shown yet. */
  interrupts = new Int32Array(new SharedArrayBuffer(8));
  /** @type {Uint8Array[]} of the file that arrives */ pieces = [];
  /** @type {[number, number, Uint8Array][]} */ waiting = [];
  /** @type {Map<number, {process: Process, number: number}>} */ ends = new Map();
  accepted = FIRST_ACCEPTED;
  /** @type {Set<number>} */ ports = new Set();
  /** @type {(text: string) => void} */ onOutput = () => {};
  /** @type {(code: number) => void} */ end = () => {};
  /** @type {Promise<number>} */ ended = new Promise((resolve) => (this.end = resolve));

  /** @param {number} number */
  constructor(number) {
    this.number = number;
  }
}

export class Hub {
  /** @type {Map<number, Process>} */ processes = new Map();
  /** The files and folders of the home folder: mode and content, by path. @type {Map<string, [number, Uint8Array]>} */
  files = new Map();
  /** Called after a file was changed or removed. @type {(path: string) => void} */
  onFile = () => {};
  /** Called after a port was closed. @type {(port: number) => void} */
  onClosedPort = () => {};
  /** The page's own connections, as those of a program without rings. @type {any} */
  #page = { ends: new Map(), connections: new Map() };
  #nextConnection = 1;
  /** Starts Python before it has a program, so that programs start sooner. @type {Process | null} */ #spare = null;
  /** Where workers start from; null until it is made. @type {import("./image.mjs").Image | null} */
  #image = null;
  /** @type {Map<number, Process>} */ #ports = new Map();
  #nextProcess = 1;
  #nextPort = FIRST_PORT;
  #buffer = new Uint8Array(RING_BYTES);

  /** @param {(data: object, onMessage: (message: any) => void) => Worker_} startWorker */
  constructor(startWorker) {
    this.startWorker = startWorker;
    const maker = startWorker({ makesImage: true }, ({ image, output, exit }) => {
      for (const each of this.processes.values()) if (output && !each.worker) each.onOutput(output);
      if (exit !== undefined) maker.terminate();
      if (!image) return;
      this.#image = image;
      for (const each of this.processes.values()) this.#startWorker(each);
      this.#spare = this.#makeWorker();
    });
  }

  /** Starts a program. `program` is passed to `pipros_tab.program.Worker.run`; `onOutput` gets what it prints.
   * @param {any} program @param {(text: string) => void} onOutput @param {Process | null} parent @returns {Process} */
  start(program, onOutput, parent = null) {
    const process = this.#spare ?? this.#makeWorker();
    this.#spare = null;
    this.processes.set(process.number, process);
    Object.assign(process, { onOutput, parent });
    parent?.children.add(process);
    const files = { ...Object.fromEntries(this.files), ...program.files };
    process.program = { ...program, files, number: process.number };
    process.worker?.postMessage(process.program);
    if (this.#image) setTimeout(() => (this.#spare ??= this.#makeWorker()), NEXT_SPARE_MS);
    return process;
  }

  /** Starts a worker that waits for a program, as soon as there is an image. */
  #makeWorker() {
    const process = new Process(this.#nextProcess++);
    if (this.#image) this.#startWorker(process);
    return process;
  }

  #startWorker(process) {
    const rings = { toHub: process.toHub.shared, fromHub: process.fromHub.shared, interrupts: process.interrupts.buffer };
    process.worker = this.startWorker({ ...rings, image: this.#image }, (message) => {
      if (message === "packets") this.#receive(process);
      else if (message === "room") this.#flush(process);
      else if ("output" in message) {
        process.onOutput(message.output);
        Atomics.sub(process.interrupts, 1, message.output.length);
        Atomics.notify(process.interrupts, 1);
      } else this.#remove(process, message.exit);
    });
    if (process.program) process.worker.postMessage(process.program);
  }

  /** Returns whether a program listens at a port. */
  listens(port) {
    return this.#ports.has(port);
  }

  /** Connects the page to a port. Returns null if no program listens there. @param {number} port */
  connect(port) {
    if (!this.listens(port)) return null;
    const number = this.#nextConnection++;
    const connection = new Connection((kind, content) => this.#handle(this.#page, kind, number, content));
    this.#page.connections.set(number, connection);
    this.#handle(this.#page, Kind.CONNECT, number, bytesOf(port));
    return connection;
  }

  /** Interrupts a program, as Ctrl-C does. It may have ended already. */
  interrupt(process) {
    Atomics.store(process.interrupts, 0, SIGINT);
    process.fromHub.wake();
  }

  /** Ends a program at once, even one that computes for ever. */
  stop(process) {
    this.#remove(process, STOPPED);
  }

  /** Passes on what a user does in a terminal: `{line: …}`, `{complete: …}` or `{stop: true}`. */
  type(process, typed) {
    this.#send(process, Kind.TYPED, 0, encoder.encode(JSON.stringify(typed)));
  }

  /** Passes on keys to the programs of a terminal. */
  press(process, keys) {
    for (const child of process.children) {
      this.type(child, { keys });
      this.press(child, keys);
    }
  }

  /** Changes a file for all programs. @param {string} path @param {Uint8Array | null} content null removes the file
   * @param {number} mode of a new file */
  writeFile(path, content, mode = 0o644) {
    const state = content === null ? null : /** @type {[number, Uint8Array]} */ ([this.files.get(path)?.[0] ?? mode, content]);
    this.#keepFile(path, state);
    for (const piece of filePackets(path, state)) this.#sendToAll(Kind.FILE, piece);
  }

  #keepFile(path, state) {
    if (state) this.files.set(path, state);
    else this.files.delete(path);
    this.onFile(path);
  }

  #sendToAll(kind, content, sender = null) {
    for (const each of this.processes.values()) if (each !== sender) this.#send(each, kind, 0, content);
  }

  /** A worker has changed a file: keep it once it is whole, and send the pieces to all others. */
  #receiveFile(process, content) {
    const line = content.indexOf(10);
    const head = JSON.parse(decoder.decode(content.subarray(0, line)));
    if ("mode" in head) {
      process.pieces.push(content.slice(line + 1));
      if (head.is_last) this.#keepFile(head.path, [head.mode, joined(process.pieces.splice(0))]);
    } else this.#keepFile(head.path, null);
    this.#sendToAll(Kind.FILE, content, process);
  }

  #remove(process, code) {
    if (!this.processes.delete(process.number)) return;
    this.#receive(process);
    process.worker?.terminate();
    for (const peer of process.ends.values()) {
      this.#send(peer.process, Kind.RESET, peer.number, NOTHING);
      peer.process.ends.delete(peer.number);
    }
    for (const port of process.ports) this.#close(port);
    process.ends.clear();
    for (const child of process.children) this.stop(child);
    process.parent?.children.delete(process);
    if (process.parent) this.#send(process.parent, Kind.ENDED, process.number, bytesOf(code & 255));
    process.end(code);
  }

  #receive(process) {
    process.toHub.lower();
    const size = process.toHub.read(this.#buffer);
    eachPacket(this.#buffer, size, (kind, end, content) => this.#handle(process, kind, end, content));
  }

  #handle(process, kind, end, content) {
    if (kind === Kind.LISTEN) {
      const port = this.#open(process, numberIn(content));
      this.#send(process, Kind.LISTENING, end, bytesOf(port));
    } else if (kind === Kind.START) {
      const child = this.start(JSON.parse(decoder.decode(content)), process.onOutput, process);
      this.#send(process, Kind.STARTED, end, bytesOf(child.number));
    } else if (kind === Kind.SIGNAL) {
      const child = this.processes.get(end);
      if (child?.parent === process) numberIn(content) === SIGKILL ? this.stop(child) : this.interrupt(child);
    } else if (kind === Kind.FILE) {
      this.#receiveFile(process, content);
    } else if (kind === Kind.CLOSE_PORT) {
      if (process.ports.delete(end)) this.#close(end);
    } else if (kind === Kind.CONNECT) {
      const listener = this.#ports.get(numberIn(content));
      if (listener === undefined) {
        this.#send(process, Kind.REFUSED, end, NOTHING);
        return;
      }
      const number = listener.accepted++;
      process.ends.set(end, { process: listener, number });
      listener.ends.set(number, { process, number: end });
      this.#send(listener, Kind.ACCEPT, number, content);
      this.#send(process, Kind.CONNECTED, end, NOTHING);
    } else {
      const peer = process.ends.get(end);
      if (peer === undefined) return; // the other end has been closed
      this.#send(peer.process, kind, peer.number, content);
      if (kind === Kind.RESET) {
        process.ends.delete(end);
        peer.process.ends.delete(peer.number);
      }
    }
  }

  #close(port) {
    this.#ports.delete(port);
    this.onClosedPort(port);
  }

  #open(process, wanted) {
    if (this.#ports.has(wanted)) return 0;
    while (this.#ports.has(this.#nextPort)) this.#nextPort = this.#nextPort < LAST_PORT ? this.#nextPort + 1 : FIRST_PORT;
    const port = wanted || this.#nextPort;
    this.#ports.set(port, process);
    process.ports.add(port);
    return port;
  }

  /** Passes a packet on. It waits if the worker's ring is full, which the windows of its connections limit. */
  #send(process, kind, end, content) {
    if (process === this.#page) {
      process.connections.get(end)?.take(kind, content);
      if (kind === Kind.RESET) process.connections.delete(end);
      return;
    }
    if (process.waiting.length === 0 && process.fromHub.write(kind, end, content)) return;
    process.waiting.push([kind, end, content.slice()]);
    process.fromHub.raise();
    this.#flush(process);
  }

  #flush(process) {
    let sent = 0;
    for (const packet of process.waiting) {
      if (!process.fromHub.write(...packet)) break;
      sent++;
    }
    process.waiting.splice(0, sent);
    if (process.waiting.length > 0) process.fromHub.raise();
  }
}
