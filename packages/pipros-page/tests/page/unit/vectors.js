// The vectors that packages/pipros-page/tests/support/page_vectors.py wrote.

import assert from "node:assert/strict";
import fs from "node:fs";

export const VECTORS = JSON.parse(fs.readFileSync(new URL("../vectors.json", import.meta.url), "utf8"));

export function close(found, expected, limit, about) {
  assert.equal(found.length, expected.length, about);
  found.forEach((value, index) => {
    const isClose = Math.abs(value - expected[index]) <= limit * Math.max(1, Math.abs(expected[index]));
    assert.ok(isClose, `${about}: ${found} instead of ${expected}`);
  });
}
