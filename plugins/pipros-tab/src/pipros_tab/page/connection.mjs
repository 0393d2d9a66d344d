// The page's side of a connection to a program's port: bytes, a request for a file, or a WebSocket.

import { bytesOf, joined, Kind, NOTHING, numberIn } from "./packets.mjs";

const WINDOW_BYTES = 256 * 1024; // as in pipros/tab/network.py
const PACKET_BYTES = 64 * 1024;
const TEXT = 1;
const BINARY = 2;
const CLOSE = 8;
const PING = 9;
const PONG = 10;
const MASKED = 0x80;
const IS_LAST = 0x80;
const LOST = 1006; // a WebSocket that ended without a close frame
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
    } else if (kind === Kind.FINISH) {
      this.close();
      this.onEnd();
    } else if (kind === Kind.RESET || kind === Kind.REFUSED) {
      const wasOver = this.#isOver;
      this.#isOver = true;
      if (!wasOver) this.onEnd();
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

/** Collects bytes, and returns those that follow the head of a response, with its first line and its headers, once it is whole. */
class Head {
  #bytes = new Uint8Array(0);

  add(piece) {
    this.#bytes = joined([this.#bytes, piece]);
    const text = decoder.decode(this.#bytes);
    const end = text.indexOf("\r\n\r\n"); // heads are ASCII, so positions in text and bytes agree
    if (end < 0) return null;
    const [first, ...lines] = text.slice(0, end).split("\r\n");
    const headers = lines.map((line) => /** @type {[string, string]} */ (line.split(/: */, 2)));
    return { status: Number(first.split(" ")[1]), headers, rest: this.#bytes.slice(end + 4) };
  }
}

/** Requests a file from the server of a program. @param {Connection} connection @param {number} port @param {string} path
 * @returns {Promise<{status: number, headers: [string, string][], body: Uint8Array<ArrayBuffer>}>} */
export function requestFile(connection, port, path) {
  return new Promise((resolve, reject) => {
    const pieces = [];
    connection.onData = (bytes) => pieces.push(bytes);
    connection.onEnd = () => {
      const found = new Head().add(joined(pieces));
      if (found) resolve({ status: found.status, headers: found.headers, body: found.rest });
      else reject(new Error(`port ${port} does not answer`));
    };
    connection.write(headOf(port, path, ["Connection: close"]));
  });
}

/** What the page's `live.js` uses of a WebSocket. The server sends each message in one frame. */
export class PortSocket {
  onopen = () => {};
  /** @type {(event: {data: string | ArrayBuffer}) => void} */
  onmessage = () => {};
  /** @type {(event: {code: number, reason: string}) => void} */
  onclose = () => {};
  binaryType = "arraybuffer";
  #head = new Head();
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
    this.#send(TEXT, encoder.encode(text));
  }

  close() {
    this.connection.close();
  }

  #take(bytes) {
    if (this.#isOpen) this.#received = joined([this.#received, bytes]);
    else {
      const head = this.#head.add(bytes);
      if (!head) return;
      this.#isOpen = true;
      this.#received = head.rest;
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
    if (kind === TEXT) this.onmessage({ data: decoder.decode(content) });
    else if (kind === BINARY) this.onmessage({ data: new this.realm.Uint8Array(content).buffer });
    else if (kind === PING) this.#send(PONG, content);
    else if (kind === CLOSE) {
      const code = content.length < 2 ? LOST : content[0] * 256 + content[1];
      this.connection.close();
      this.onclose({ code, reason: decoder.decode(content.subarray(2)) });
    }
  }

  /** Sends a frame whose mask is zero: nothing between the two ends could mistake it for HTTP. */
  #send(kind, content) {
    const size = content.length;
    const length = size < 126 ? [MASKED | size] : [MASKED | (size < 65536 ? 126 : 127), ...sizeBytes(size)];
    this.connection.write(joined([Uint8Array.of(IS_LAST | kind, ...length, 0, 0, 0, 0), content]));
  }
}

function sizeBytes(size) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setBigUint64(0, BigInt(size));
  return size < 65536 ? bytes.slice(6) : bytes;
}
