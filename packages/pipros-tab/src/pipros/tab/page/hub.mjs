// The hub of a tab: starts and ends workers, which run one Python program each, and connects them.
// It runs where the page runs, never waits, and knows nothing of ROS: it passes bytes between ports.

import { eachPacket, Ring, RING_BYTES, sharedRing } from "./ring.mjs";

const LISTEN = 1;
const LISTENING = 2;
const CLOSE_PORT = 3;
const CONNECT = 4;
const CONNECTED = 5;
const REFUSED = 6;
const ACCEPT = 7;
const RESET = 11;
const FIRST_PORT = 20_000;
const LAST_PORT = 59_999;
const FIRST_ACCEPTED = 0x80000000; // numbers of ends that workers accept; they number the others from 1
const SIGINT = 2; // Pyodide's interrupt buffer has the number of the signal
const NOTHING = new Uint8Array(0);

/**
 * One program in a worker.
 * @typedef {{
 *   number: number, worker: {terminate: () => unknown}, toHub: Ring, fromHub: Ring, interrupts: Int32Array,
 *   waiting: [number, number, Uint8Array][], ends: Map<number, {process: Process, number: number}>,
 *   accepted: number, ports: Set<number>, program: object, onOutput: (text: string) => void,
 *   ended: Promise<number>, end: (code: number) => void
 * }} Process
 */

export class Hub {
  /** @type {Map<number, Process>} */
  processes = new Map();
  /** @type {Map<number, Process>} */
  #ports = new Map();
  #nextProcess = 1;
  #nextPort = FIRST_PORT;
  #buffer = new Uint8Array(RING_BYTES);

  /** @param {(data: object, onMessage: (message: any) => void) => {terminate: () => unknown}} startWorker */
  constructor(startWorker) {
    this.startWorker = startWorker;
  }

  /**
   * Starts a program. `program` is passed to `pipros.tab.program.run`; `onOutput` gets what it prints.
   * @param {object} program
   * @param {(text: string) => void} onOutput
   * @returns {Process}
   */
  start(program, onOutput) {
    const toHub = sharedRing();
    const fromHub = sharedRing();
    const interrupts = new SharedArrayBuffer(4);
    const number = this.#nextProcess++;
    /** @type {(code: number) => void} */
    let end = () => {};
    const ended = new Promise((resolve) => (end = resolve));
    /** @type {Process} */
    const process = {
      number,
      worker: { terminate() {} },
      toHub: new Ring(toHub),
      fromHub: new Ring(fromHub),
      interrupts: new Int32Array(interrupts),
      waiting: [],
      ends: new Map(),
      accepted: FIRST_ACCEPTED,
      ports: new Set(),
      program,
      onOutput,
      ended,
      end,
    };
    this.processes.set(number, process);
    process.worker = this.startWorker({ toHub, fromHub, interrupts, program }, (message) => {
      if (message === "packets") this.#receive(process);
      else if (message === "room") this.#flush(process);
      else if ("output" in message) onOutput(message.output);
      else this.#remove(process, message.exit);
    });
    return process;
  }

  /** Interrupts a program, as Ctrl-C does. It may have ended already. */
  interrupt(process) {
    Atomics.store(process.interrupts, 0, SIGINT);
    process.fromHub.wake();
  }

  /** Ends a program at once, even one that computes for ever. */
  stop(process) {
    this.#remove(process, 137);
  }

  #remove(process, code) {
    if (!this.processes.delete(process.number)) return;
    this.#receive(process);
    process.worker.terminate();
    for (const peer of process.ends.values()) this.#send(peer.process, RESET, peer.number, NOTHING);
    for (const port of process.ports) this.#ports.delete(port);
    for (const peer of process.ends.values()) peer.process.ends.delete(peer.number);
    process.ends.clear();
    process.end(code);
  }

  #receive(process) {
    process.toHub.lower();
    const size = process.toHub.read(this.#buffer);
    eachPacket(this.#buffer, size, (kind, end, content) => this.#handle(process, kind, end, content));
  }

  #handle(process, kind, end, content) {
    if (kind === LISTEN) {
      const port = this.#open(process, numberIn(content));
      this.#send(process, LISTENING, end, bytesOf(port));
    } else if (kind === CLOSE_PORT) {
      if (process.ports.delete(end)) this.#ports.delete(end);
    } else if (kind === CONNECT) {
      const listener = this.#ports.get(numberIn(content));
      if (listener === undefined) {
        this.#send(process, REFUSED, end, NOTHING);
        return;
      }
      const number = listener.accepted++;
      process.ends.set(end, { process: listener, number });
      listener.ends.set(number, { process, number: end });
      this.#send(listener, ACCEPT, number, content);
      this.#send(process, CONNECTED, end, NOTHING);
    } else {
      const peer = process.ends.get(end);
      if (peer === undefined) return; // the other end has been closed
      this.#send(peer.process, kind, peer.number, content);
      if (kind === RESET) {
        process.ends.delete(end);
        peer.process.ends.delete(peer.number);
      }
    }
  }

  #open(process, wanted) {
    let port = wanted;
    if (!wanted) {
      while (this.#ports.has(this.#nextPort)) this.#nextPort = this.#nextPort < LAST_PORT ? this.#nextPort + 1 : FIRST_PORT;
      port = this.#nextPort;
    } else if (this.#ports.has(port)) return 0;
    this.#ports.set(port, process);
    process.ports.add(port);
    return port;
  }

  /** Passes a packet on. It waits if the worker's ring is full, which the windows of its connections limit. */
  #send(process, kind, end, content) {
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

function numberIn(content) {
  return new DataView(content.buffer, content.byteOffset).getUint32(0, true);
}

function bytesOf(number) {
  const bytes = new Uint8Array(4);
  new DataView(bytes.buffer).setUint32(0, number, true);
  return bytes;
}
