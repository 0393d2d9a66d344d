import assert from "node:assert/strict";
import test from "node:test";
import { decoderOf } from "../page/scene/layout.js";
import { VECTORS } from "./vectors.js";

// Writes values as packages/pipros-page/tests/support/page_vectors.py does.
function plain(value) {
  if (typeof value === "bigint") return String(value);
  if (typeof value === "boolean") return Number(value);
  if (typeof value === "number" && !Number.isFinite(value)) return Number.isNaN(value) ? "nan" : value > 0 ? "inf" : "-inf";
  if (ArrayBuffer.isView(value) || Array.isArray(value)) return Array.from(value, plain);
  return typeof value === "object" ? Object.fromEntries(Object.entries(value).map(([name, each]) => [name, plain(each)])) : value;
}

test("messages of every included type have the fields of the library", () => {
  assert.ok(VECTORS.messages.length > 100);
  for (const [name, types, hex, expected] of VECTORS.messages) {
    const bytes = Uint8Array.from(Buffer.from(hex, "hex"));
    assert.deepEqual(plain(decoderOf(types, name)(new DataView(bytes.buffer))), expected, name);
  }
});

test("truncated messages are errors", () => {
  for (const [name, types, hex] of VECTORS.messages.filter(([, , each]) => each.length < 2000)) {
    const bytes = Uint8Array.from(Buffer.from(hex, "hex"));
    const decode = decoderOf(types, name);
    for (let size = 0; size < bytes.length; size += 1) assert.throws(() => decode(new DataView(bytes.buffer, 0, size)), Error,
      `${name}: ${size}`);
  }
});

test("counts beyond the message are refused before memory is allocated", () => {
  const types = { "a/Path": [["poses", "a/Pose", 0]], "a/Pose": [["x", "float64", -1]], "a/Empties": [["all", "a/Empty", 0]],
    "a/Empty": [] };
  const view = new DataView(Uint8Array.from([255, 255, 255, 255]).buffer);
  assert.throws(() => decoderOf(types, "a/Path")(view), /an array of 4294967295 elements does not fit into the message/);
  assert.throws(() => decoderOf(types, "a/Empties")(view), /an array of 4294967295 elements/);
});

test("numbers that a graphics card lacks become large ones, but NaN and infinity stay", () => {
  const types = { "a/Far": [["one", "float64", -1], ["all", "float64", 5], ["small", "float32", 2]] };
  const bytes = new Uint8Array(44);
  new Uint8Array(bytes.buffer).set(new Uint8Array(Float64Array.of(1e300, -1e300, NaN, -Infinity, 2.5).buffer));
  new Uint8Array(bytes.buffer).set(new Uint8Array(Float32Array.of(3e38).buffer), 40);
  const { one, all, small } = decoderOf(types, "a/Far")(new DataView(bytes.buffer));
  assert.deepEqual([one, [...all], [...small]], [1e19, [-1e19, NaN, -Infinity, 2.5], [Math.fround(1e19)]]);
});
