// Decoders for serialized messages, composed from the layout that the server sends (web/messages/layout.py).
// Times are nanoseconds (BigInt), arrays of numbers are typed arrays, and floats are `drawable`.

import { drawable } from "./pose.js";
import { PRIMITIVES } from "./primitives.js";

const TEXT = new TextDecoder();
const NS = 1000000000n;

// Returns the size, the reader and the typed array of a number.
/** @type {(name: string, form: any) => [any, any, any]} */
function scalar(name, [kind, size]) {
  const get = DataView.prototype[`get${kind}`];
  const Numbers = globalThis[`${kind}Array`];
  if (name === "bool") return [size, (view, at) => view.getUint8(at) !== 0, Numbers];
  if (kind.startsWith("Float")) return [size, (view, at) => drawable(get.call(view, at, true)), Numbers];
  return [size, (view, at) => get.call(view, at, true), Numbers];
}

const SCALARS = Object.fromEntries(Object.entries(PRIMITIVES).map(([name, form]) => [name, scalar(name, form)]));

const NONE = -1; // not an array
const EMPTY_ELEMENTS = 65536; // maximum number of elements without bytes in one array

// The data that a decoder reads, and its position.
class Reader {
  constructor(view) {
    this.view = view;
    this.at = 0;
  }

  take(size) {
    const from = this.at;
    if (size > this.view.byteLength - from)
      throw new Error(`the message ends after ${this.view.byteLength} bytes, but ${from + size} are needed`);
    this.at = from + size;
    return from;
  }

  count(least) {
    const count = this.view.getUint32(this.take(4), true);
    const most = least ? (this.view.byteLength - this.at) / least : EMPTY_ELEMENTS;
    if (count > most) throw new Error(`an array of ${count} elements does not fit into the message`);
    return count;
  }
}

// Returns a function that decodes a message of the type, in a DataView, to an object.
export function decoderOf(types, name) {
  const read = compose(types, name).read;
  return (view) => read(new Reader(view));
}

// Returns how to read a type, and the least number of bytes that it takes.
function compose(types, name) {
  if (name in SCALARS) {
    const [size, get] = SCALARS[name];
    return { least: size, read: (reader) => get(reader.view, reader.take(size)) };
  }
  if (name === "string") return { least: 4, read: text() };
  if (name === "time") return { least: 8, read: (reader) => nanoseconds(reader, (view, at) => view.getUint32(at, true)) };
  if (name === "duration") return { least: 8, read: (reader) => nanoseconds(reader, (view, at) => view.getInt32(at, true)) };
  const fields = types[name].map(([field, base, array]) => [field, fieldOf(types, base, array)]);
  const least = fields.reduce((sum, [, field]) => sum + field.least, 0);
  const read = (reader) => {
    const message = {};
    for (const [field, { read: readField }] of fields) message[field] = readField(reader);
    return message;
  };
  return { least, read };
}

function fieldOf(types, base, array) {
  const element = compose(types, base);
  if (array === NONE) return element;
  const isFixed = array > 0;
  const countOf = isFixed ? () => array - 1 : (reader) => reader.count(element.least);
  const read = base in SCALARS ? numbers(SCALARS[base], countOf) : (reader) => {
    const found = [];
    for (let left = countOf(reader); left > 0; left -= 1) found.push(element.read(reader));
    return found;
  };
  return { least: isFixed ? element.least * (array - 1) : 4, read };
}

const numbers = ([size, , Numbers], countOf) => (reader) => {
  const count = countOf(reader);
  const from = reader.view.byteOffset + reader.take(count * size);
  const found = new Numbers(reader.view.buffer.slice(from, from + count * size));
  return Numbers.name.startsWith("Float") ? found.map(drawable) : found;
};

// Returns how to read a text. The last one is kept, because a field often has the same text in many elements.
function text() {
  let known = new Uint8Array(0);
  let found = "";
  return (reader) => {
    const size = reader.count(1);
    const bytes = new Uint8Array(reader.view.buffer, reader.view.byteOffset + reader.take(size), size);
    if (size !== known.length || bytes.some((byte, at) => byte !== known[at])) [known, found] = [bytes.slice(), TEXT.decode(bytes)];
    return found;
  };
}

function nanoseconds(reader, get) {
  const at = reader.take(8);
  return BigInt(get(reader.view, at)) * NS + BigInt(get(reader.view, at + 4));
}
