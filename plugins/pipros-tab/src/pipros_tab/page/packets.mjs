// The kinds of packets between workers and the hub, as in pipros_tab/packets.py, and their content.

export const Kind = {
  LISTEN: 1, LISTENING: 2, CLOSE_PORT: 3, CONNECT: 4, CONNECTED: 5, REFUSED: 6, ACCEPT: 7, DATA: 8, CREDIT: 9, FINISH: 10, RESET: 11,
  START: 12, STARTED: 13, ENDED: 14, SIGNAL: 15, FILE: 16, TYPED: 17,
};
export const IS_FOLDER = 0o040000;
const PIECE_BYTES = 48 * 1024;
export const NOTHING = new Uint8Array(0);
const encoder = new TextEncoder();

/** Yields the contents of the FILE packets for a file, a folder, or its removal if `state` is null. */
export function* filePackets(path, state) {
  if (!state) {
    yield packed({ path }, NOTHING);
    return;
  }
  const [mode, content] = state;
  const size = mode & IS_FOLDER ? 0 : content.length;
  for (let start = 0; start < Math.max(size, 1); start += PIECE_BYTES) {
    const head = { path, mode, is_last: start + PIECE_BYTES >= size };
    yield packed(head, content.subarray(start, start + PIECE_BYTES));
  }
}

function packed(head, piece) {
  return joined([encoder.encode(`${JSON.stringify(head)}\n`), piece]);
}

/** Copies arrays of bytes into one; `Buffer` may be SharedArrayBuffer. @returns {Uint8Array<any>} */
export function joined(pieces, Buffer = /** @type {any} */ (ArrayBuffer)) {
  const whole = new Uint8Array(new Buffer(pieces.reduce((size, piece) => size + piece.length, 0)));
  let at = 0;
  for (const piece of pieces) {
    whole.set(piece, at);
    at += piece.length;
  }
  return whole;
}

export const numberIn = (content) => new DataView(content.buffer, content.byteOffset).getUint32(0, true);
export const bytesOf = (number) => new Uint8Array(Uint32Array.of(number).buffer);
