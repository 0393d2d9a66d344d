import assert from "node:assert/strict";
import test from "node:test";
import { VECTORS } from "./vectors.js";

globalThis.location = /** @type {any} */ ({ hash: "", protocol: "http:", host: "" });
const { isStale, levelNow } = await import("../page/stale.js");

test("the browser decides as the server does", () => {
  for (const [age, interval, expected] of VECTORS.stale) assert.equal(isStale(age, interval), expected, `${age} ${interval}`);
});

test("a component is stale when its last report is too old", () => {
  const data = { now: 100, stale: 5 };
  assert.deepEqual(levelNow({ last: 96, level: 1 }, data), { age: 4, level: 1 });
  assert.deepEqual(levelNow({ last: 94, level: 1 }, data), { age: 6, level: 3 });
});
