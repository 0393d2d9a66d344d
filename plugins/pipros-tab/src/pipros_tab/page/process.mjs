// A worker's side of the hub: starts Python, gives it the rings, and runs one program once the hub has sent it.

import { imageOf, startFrom } from "./image.mjs";
import { Ring, RING_BYTES } from "./ring.mjs";

const CONTENT_BYTES = 64 * 1024;
const ROOM_MS = 100;
const MOST_UNSHOWN = 16 * 1024; // characters

/** The rings, as `pipros_tab.program` uses them. */
class Rings {
  /** @param {{toHub: SharedArrayBuffer, fromHub: SharedArrayBuffer, interrupts: Int32Array}} shared @param {Function} post */
  constructor({ toHub, fromHub, interrupts }, post) {
    this.toHub = new Ring(toHub);
    this.fromHub = new Ring(fromHub);
    this.interrupts = interrupts;
    this.post = post;
    this.content = new Uint8Array(CONTENT_BYTES);
    this.received = new Uint8Array(RING_BYTES);
  }

  /** Sends a packet with the first `size` bytes of `content`. */
  send(kind, end, size) {
    const content = this.content.subarray(0, size);
    while (!this.toHub.write(kind, end, content)) {
      this.post("packets");
      this.toHub.waitForRoom(ROOM_MS);
    }
    if (this.toHub.raise()) this.post("packets");
  }

  /** Waits for packets, and moves them to `received`; returns their size. */
  receive(milliseconds) {
    if (Atomics.load(this.interrupts, 0) === 0) this.fromHub.waitForData(milliseconds);
    const size = this.fromHub.read(this.received);
    if (size > 0 && this.fromHub.lower()) this.post("room");
    return size;
  }

  isInterrupted() {
    return Atomics.exchange(this.interrupts, 0, 0) !== 0;
  }
}

async function makeImage(startPython) {
  const prepared = await startPython({ _makeSnapshot: true });
  prepared.runPython("from pipros_tab import program; program.prepare()");
  return imageOf(prepared);
}

/**
 * Starts Python, waits for a program, runs it, and posts its exit code. Or makes the image from which other workers start.
 * @param {any} data from the hub
 * @param {Promise<object>} program
 * @param {(message: unknown) => void} post
 * @param {(options: object) => Promise<any>} loadPyodide starts Pyodide
 * @param {(options: object) => Promise<any>} startPython starts Pyodide with pipros
 * @param {() => Promise<any>} openImages returns where images are kept, or null
 */
export async function runProcess(data, program, post, loadPyodide, startPython, openImages) {
  const interrupts = new Int32Array(data.interrupts ?? new SharedArrayBuffer(8));
  const write = (text) => {
    Atomics.add(interrupts, 1, data.interrupts ? text.length : 0);
    post({ output: text });
    const unshown = () => (Atomics.load(interrupts, 0) ? 0 : Atomics.load(interrupts, 1)); // an interrupted program does not wait
    for (let most = unshown(); most > MOST_UNSHOWN; most = unshown()) Atomics.wait(interrupts, 1, most, ROOM_MS);
  };
  const decoder = new TextDecoder();
  const output = { write: (bytes) => (write(decoder.decode(bytes, { stream: true })), bytes.length) };
  let code = 1;
  try {
    if (data.makesImage) {
      const images = await openImages().catch(() => null); // a browser may forbid to keep anything
      const kept = await images?.read();
      const image = kept ?? (await makeImage(startPython));
      post({ image });
      if (!kept) await images?.write(image);
      return post({ exit: 0 });
    }
    const pyodide = await startFrom(data.image, loadPyodide);
    pyodide.setStdout(output);
    pyodide.setStderr(output);
    const rings = new Rings({ ...data, interrupts }, post);
    pyodide.setInterruptBuffer(interrupts);
    const worker = pyodide.pyimport("pipros_tab.program").start(rings);
    code = worker.run(pyodide.toPy(await program));
  } catch (error) {
    write(`${error.message ?? error}\n`);
  }
  post({ exit: code });
}
