// A message that the server sends in parts (PART_BYTES in view_server.py), so that a slow link does not look like a silent server.
// Each part begins with the request's number plus 2^31, in four big-endian bytes, and its kind.

const FIRST_NUMBER = 2 ** 31;
const MORE = 0; // other kinds: the last part of a text, or of a binary message
const LAST_OF_TEXT = 1;
const HEAD_BYTES = 5;

// Returns the number of the request to which a part belongs; null if the data (ArrayBuffer) are a whole message.
export function partOf(data) {
  const number = new DataView(data).getUint32(0);
  return number < FIRST_NUMBER ? null : number - FIRST_NUMBER;
}

export class PartialMessage {
  constructor() {
    this.parts = [];
  }

  // Adds a part. Returns the message, a text or an ArrayBuffer, if it is complete; otherwise null.
  add(data) {
    const kind = new Uint8Array(data)[HEAD_BYTES - 1];
    this.parts.push(new Uint8Array(data, HEAD_BYTES));
    if (kind === MORE) return null;
    const whole = new Uint8Array(this.parts.reduce((size, part) => size + part.length, 0));
    let end = 0;
    for (const part of this.parts) {
      whole.set(part, end);
      end += part.length;
    }
    this.parts = [];
    return kind === LAST_OF_TEXT ? new TextDecoder().decode(whole) : whole.buffer;
  }
}
