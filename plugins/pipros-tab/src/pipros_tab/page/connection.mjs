// The page's side of a connection to a program's port: bytes, a request for a file, or a WebSocket.

import { bytesOf, joined, Kind, NOTHING, numberIn } from "./packets.mjs";

const WINDOW_BYTES = 256 * 1024; // as in pipros_tab/network.py
const PACKET_BYTES = 64 * 1024;
const Frame = { TEXT: 1, BINARY: 2, CLOSE: 8, PING: 9, PONG: 10 }; // the kinds of a WebSocket's frames
const MASKED = 0x80;
const IS_LAST = 0x80;
const LOST = 1006; // a WebSocket that ended without a close frame
const ENDS = new Set([Kind.FINISH, Kind.RESET, Kind.REFUSED]);
const encoder = new TextEncoder();
const decoder = new TextDecoder();

export class Connection {
  /** @type {(bytes: Uint8Array<ArrayBuffer>) => void} */
  onData = () => {};
  onEnd = () => {};
  #credit = WINDOW_BYTES;
  #unreported = 0;
  /** @type {Uint8Array[]} */
  #waiting = [];
  #isOver = false;

  /** @param {(kind: number, content: Uint8Array) => void} send passes a packet to the other end */
  constructor(send) {
    this.send = send;
  }

  /** @param {Uint8Array} bytes */
  write(bytes) {
    for (let at = 0; at < bytes.length; at += PACKET_BYTES) this.#waiting.push(bytes.subarray(at, at + PACKET_BYTES));
    this.#flush();
  }

  close() {
    if (!this.#isOver) this.send(Kind.RESET, NOTHING);
    this.#isOver = true;
  }

  /** Handles a packet from the other end. */
  take(kind, content) {
    if (kind === Kind.DATA) {
      this.onData(content.slice());
      this.#unreported += content.length;
      if (this.#unreported >= WINDOW_BYTES / 4 && !this.#isOver) {
        this.send(Kind.CREDIT, bytesOf(this.#unreported));
        this.#unreported = 0;
      }
    } else if (kind === Kind.CREDIT) {
      this.#credit += numberIn(content);
      this.#flush();
    } else if (ENDS.has(kind) && !this.#isOver) {
      if (kind === Kind.FINISH) this.close();
      this.#isOver = true;
      this.onEnd();
    }
  }

  #flush() {
    while (this.#waiting.length > 0 && this.#credit >= this.#waiting[0].length && !this.#isOver) {
      const piece = /** @type {Uint8Array} */ (this.#waiting.shift());
      this.#credit -= piece.length;
      this.send(Kind.DATA, piece);
    }
  }
}

const headOf = (port, path, more) =>
  encoder.encode([`GET ${path} HTTP/1.1`, `Host: localhost:${port}`, ...more, "", ""].join("\r\n"));

/**
 * Splits bytes after the head of a response. Returns null if the head, or a body of known length, is not whole.
 * @param {Uint8Array<ArrayBuffer>} bytes
 */
function split(bytes) {
  const text = decoder.decode(bytes);
  const end = text.indexOf("\r\n\r\n"); // heads are ASCII, so positions in text and bytes agree
  if (end < 0) return null;
  const [first, ...lines] = text.slice(0, end).split("\r\n");
  const headers = lines.map((line) => /** @type {[string, string]} */ (line.split(/: */, 2)));
  const body = bytes.slice(end + 4);
  const [, length] = headers.find(([name]) => name.toLowerCase() === "content-length") ?? [];
  return Number(length) > body.length ? null : { status: Number(first.split(" ")[1]), headers, body };
}

const MOST_REQUESTS = 4;
const ATTEMPTS = 3;

/** Requests files of programs. A server closes connections whose requests wait for more than ten seconds, as those of a busy machine do
 * if there are many: therefore only a few are made at the same time, and each one again if it gets no answer. */
export class Requests {
  #open = 0;
  /** @type {(() => void)[]} */
  #waiting = [];

  /** @param {(port: number) => Connection | null} connect */
  constructor(connect) {
    this.connect = connect;
  }

  /** @param {number} port @param {string} path */
  async get(port, path) {
    if (this.#open >= MOST_REQUESTS) await new Promise((resolve) => this.#waiting.push(() => resolve(undefined)));
    else this.#open++;
    try {
      for (let attempt = 1; attempt <= ATTEMPTS; attempt++) {
        const answer = split(await this.#request(port, path));
        if (answer) return answer;
      }
      throw new Error(`port ${port} does not answer`);
    } finally {
      const next = this.#waiting.shift();
      if (next) next();
      else this.#open--;
    }
  }

  /** Sends a request, and returns all bytes that follow. @returns {Promise<Uint8Array<ArrayBuffer>>} */
  #request(port, path) {
    const connection = this.connect(port);
    if (!connection) throw new Error(`no program listens at port ${port}`);
    return new Promise((resolve) => {
      const pieces = [];
      connection.onData = (bytes) => pieces.push(bytes);
      connection.onEnd = () => resolve(joined(pieces));
      connection.write(headOf(port, path, ["Connection: close"]));
    });
  }
}

/** What the page's `live.js` uses of a WebSocket. The server sends each message in one frame. */
export class PortSocket {
  onopen = () => {};
  /** @type {(event: {data: string | ArrayBuffer}) => void} */
  onmessage = () => {};
  /** @type {(event: {code: number, reason: string}) => void} */
  onclose = () => {};
  binaryType = "arraybuffer";
  #isOpen = false;
  #received = new Uint8Array(0);

  /**
   * @param {Connection} connection
   * @param {number} port
   * @param {any} realm the window whose code gets the messages: each has an ArrayBuffer of its own
   */
  constructor(connection, port, realm) {
    this.connection = connection;
    this.realm = realm;
    connection.onData = (bytes) => this.#take(bytes);
    connection.onEnd = () => this.onclose({ code: LOST, reason: "" });
    const key = btoa(String.fromCharCode(...crypto.getRandomValues(new Uint8Array(16))));
    const upgrade = ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13", `Sec-WebSocket-Key: ${key}`];
    connection.write(headOf(port, "/live", [`Origin: http://localhost:${port}`, ...upgrade]));
  }

  /** @param {string} text */
  send(text) {
    this.#send(Frame.TEXT, encoder.encode(text));
  }

  close() {
    this.connection.close();
  }

  #take(bytes) {
    this.#received = joined([this.#received, bytes]);
    if (!this.#isOpen) {
      const answer = split(this.#received);
      if (!answer) return;
      this.#isOpen = true;
      this.#received = answer.body;
      this.onopen();
    }
    for (let frame = this.#next(); frame; frame = this.#next()) this.#handle(...frame);
  }

  /** Removes the first frame from the received bytes, and returns its kind and content, if it is whole. */
  #next() {
    const bytes = this.#received;
    if (bytes.length < 2) return null;
    const view = new DataView(bytes.buffer);
    const short = bytes[1] & 127;
    const start = short === 127 ? 10 : short === 126 ? 4 : 2;
    if (bytes.length < start) return null;
    const size = short === 127 ? Number(view.getBigUint64(2)) : short === 126 ? view.getUint16(2) : short;
    if (bytes.length < start + size) return null;
    this.#received = bytes.slice(start + size);
    return /** @type {[number, Uint8Array]} */ ([bytes[0] & 15, bytes.subarray(start, start + size)]);
  }

  #handle(kind, content) {
    if (kind === Frame.TEXT) this.onmessage({ data: decoder.decode(content) });
    else if (kind === Frame.BINARY) this.onmessage({ data: new this.realm.Uint8Array(content).buffer });
    else if (kind === Frame.PING) this.#send(Frame.PONG, content);
    else if (kind === Frame.CLOSE) {
      const code = content.length < 2 ? LOST : content[0] * 256 + content[1];
      this.connection.close();
      this.onclose({ code, reason: decoder.decode(content.subarray(2)) });
    }
  }

  /** Sends a frame whose mask is zero: nothing between the two ends could mistake it for HTTP. */
  #send(kind, content) {
    const size = content.length;
    const bytes = [size >> 24, size >> 16, size >> 8, size]; // the lowest eight bits of each
    const [short, length] = size < 126 ? [size, []] : size < 65536 ? [126, bytes.slice(2)] : [127, [0, 0, 0, 0, ...bytes]];
    this.connection.write(joined([Uint8Array.of(IS_LAST | kind, MASKED | short, ...length, 0, 0, 0, 0), content]));
  }
}
