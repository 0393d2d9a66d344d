// A queue of packets in shared memory, from one worker to the hub or back: one side writes, the other reads.
// A packet is three 32-bit numbers (size of the content, kind, end of a connection) and its content; see pipros_tab/packets.py.

export const RING_BYTES = 1 << 20; // a power of two, because positions are uint32 and wrap around
const STATE_BYTES = 16;
const HEAD_BYTES = 12;
const WRITTEN = 0; // position of the writer
const READ = 1; // position of the reader
const FLAG = 2; // set by the writer if the reader is to be notified, or by a writer that waits for room

export class Ring {
  /** @param {SharedArrayBuffer} shared that of the other side, which has the same property */
  constructor(shared = new SharedArrayBuffer(STATE_BYTES + RING_BYTES)) {
    this.shared = shared;
    this.state = new Int32Array(shared, 0, 4);
    this.data = new Uint8Array(shared, STATE_BYTES);
  }

  get used() {
    return (Atomics.load(this.state, WRITTEN) - Atomics.load(this.state, READ)) >>> 0;
  }

  /** Sets the flag; returns whether it was not set before. */
  raise() {
    return Atomics.exchange(this.state, FLAG, 1) === 0;
  }

  /** Clears the flag; returns whether it was set. */
  lower() {
    return Atomics.exchange(this.state, FLAG, 0) === 1;
  }

  /** Appends a packet, and wakes a reader that waits. Returns false if there is no room. @param {Uint8Array} content */
  write(kind, end, content) {
    const size = HEAD_BYTES + content.length;
    if (this.used + size > RING_BYTES) return false;
    const start = Atomics.load(this.state, WRITTEN);
    this.#put(start, new Uint8Array(Uint32Array.of(content.length, kind, end).buffer));
    this.#put(start + HEAD_BYTES, content);
    Atomics.store(this.state, WRITTEN, (start + size) | 0);
    Atomics.notify(this.state, WRITTEN);
    return true;
  }

  /** Waits until the ring is not empty, for a time in milliseconds. A worker's thread only. */
  waitForData(milliseconds) {
    const written = Atomics.load(this.state, WRITTEN);
    if (this.used === 0 && milliseconds > 0) Atomics.wait(this.state, WRITTEN, written, milliseconds);
  }

  /** Waits until packets were read, for a time in milliseconds. A worker's thread only. */
  waitForRoom(milliseconds) {
    Atomics.wait(this.state, READ, Atomics.load(this.state, READ), milliseconds);
  }

  /** Wakes a reader that waits although nothing was written. */
  wake() {
    Atomics.notify(this.state, WRITTEN);
  }

  /** Moves all packets into a buffer of at least RING_BYTES; returns the number of bytes. @param {Uint8Array} buffer */
  read(buffer) {
    const size = this.used;
    if (size === 0) return 0;
    const start = Atomics.load(this.state, READ) & (RING_BYTES - 1);
    const first = Math.min(size, RING_BYTES - start);
    buffer.set(this.data.subarray(start, start + first), 0);
    buffer.set(this.data.subarray(0, size - first), first);
    Atomics.add(this.state, READ, size);
    Atomics.notify(this.state, READ);
    return size;
  }

  /** @param {number} position @param {Uint8Array} bytes */
  #put(position, bytes) {
    const start = position & (RING_BYTES - 1);
    const first = Math.min(bytes.length, RING_BYTES - start);
    this.data.set(bytes.subarray(0, first), start);
    this.data.set(bytes.subarray(first), 0);
  }
}

/** Calls `handle(kind, end, content)` for each packet in the first `size` bytes of a buffer. */
export function eachPacket(buffer, size, handle) {
  const view = new DataView(buffer.buffer, buffer.byteOffset, size);
  for (let at = 0; at < size; ) {
    const length = view.getUint32(at, true);
    const content = at + HEAD_BYTES;
    handle(view.getUint32(at + 4, true), view.getUint32(at + 8, true), buffer.subarray(content, content + length));
    at = content + length;
  }
}
