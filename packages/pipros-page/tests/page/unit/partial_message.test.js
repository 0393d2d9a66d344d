import assert from "node:assert/strict";
import test from "node:test";
import { PartialMessage, partOf } from "../page/partial_message.js";

function part(number, kind, content) {
  const data = new Uint8Array(5 + content.length);
  new DataView(data.buffer).setUint32(0, number);
  data.set([kind, ...content], 4);
  return data.buffer;
}

test("parts are told from whole messages by the number", () => {
  assert.equal(partOf(part(2 ** 31 - 1, 0, [])), null);
  assert.equal(partOf(part(2 ** 31, 0, [])), 0);
  assert.equal(partOf(part(2 ** 31 + 7, 0, [])), 7);
});

test("a text is complete with its last part, even if a character is divided", () => {
  const bytes = [...new TextEncoder().encode("größer €")];
  for (let cut = 0; cut <= bytes.length; cut++) {
    const message = new PartialMessage();
    assert.equal(message.add(part(2 ** 31, 0, bytes.slice(0, cut))), null);
    assert.equal(message.add(part(2 ** 31, 1, bytes.slice(cut))), "größer €");
  }
});

test("a binary message is complete with its last part, and another one can follow", () => {
  const message = new PartialMessage();
  for (const first of [1, 100]) {
    assert.equal(message.add(part(2 ** 31, 0, [first, 2])), null);
    assert.equal(message.add(part(2 ** 31, 0, [3])), null);
    assert.deepEqual([...new Uint8Array(message.add(part(2 ** 31, 2, [4, 5])))], [first, 2, 3, 4, 5]);
  }
});
