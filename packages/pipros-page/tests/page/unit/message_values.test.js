import assert from "node:assert/strict";
import test from "node:test";
import { anglesOf, anglesText } from "../page/angles.js";
import { covarianceText, numberText, numbersIn } from "../page/message_values.js";
import { bellText, placeOfNotice } from "../page/notice_texts.js";
import { VECTORS, close } from "./vectors.js";

const matrix = (size, diagonal) => Array.from({ length: size * size }, (_, at) => (at % (size + 1) ? 0 : diagonal));

test("covariances are folded to the deviations of their diagonals", () => {
  assert.equal(covarianceText("covariance", matrix(6, 0.25)), "6 × 6, σ 0.5 0.5 0.5 0.5 0.5 0.5");
  assert.equal(covarianceText("orientation_covariance", [-1, 0, 0, 0, 4, 0, 0, 0, 9]), "3 × 3, σ – 2 3");
  assert.equal(covarianceText("position_covariance", matrix(3, 0)), "3 × 3, zero");
  for (const [key, value] of [["ranges", matrix(3, 1)], ["covariance", [1, 2]], ["covariance", ["nan", 1, 1, 1]], ["covariance", 4]])
    assert.equal(covarianceText(key, value), "");
});

test("numbers of messages have the paths of their fields", () => {
  assert.deepEqual(numbersIn({ header: { seq: 1 }, pose: { x: 1, tags: [2, { y: 3 }] } }, 9),
    [["pose/x", 1], ["pose/tags[0]", 2], ["pose/tags[1]/y", 3]]);
});

test("numbers that JSON lacks are numbers of curves, and negative zero is shown", () => {
  assert.deepEqual(numbersIn({ a: { "#": "nan" }, b: { "#": "-inf" }, c: { "#": "18446744073709551615" }, d: "nan" }, 9),
    [["a", NaN], ["b", -Infinity], ["c", 2 ** 64]]);
  assert.deepEqual([-0, 0, 0.1, 2 ** 53].map(numberText), ["-0.0", "0", "0.1", "9007199254740992"]);
});

test("the bell counts errors first and leads to what it names", () => {
  assert.equal(bellText([], 0), "No changes in the last minute");
  assert.equal(bellText([{ what: "back" }], 0), "1 change in the last minute");
  assert.equal(bellText([{ what: "error" }, { what: "stale" }, { what: "back" }], 2),
    "1 error and 2 other changes in the last minute; 2 stale now");
  assert.equal(placeOfNotice({ what: "stale", kind: "frame", name: "hand" }), "#tf/hand");
  assert.equal(placeOfNotice({ what: "stale", kind: "topic", name: "/scan" }), "#topics//scan");
  assert.equal(placeOfNotice({ what: "error", kind: "component", name: "/Motors/left" }), "#diagnostics//Motors/left");
  assert.equal(placeOfNotice({ what: "error", kind: "node", name: "/arm" }), "#console/%3Blevels%3D8%2C16%3Bnode%3D/arm");
});

test("roll, pitch and yaw are those of the library, for any norm and in gimbal lock", () => {
  for (const [[x, y, z, w], degrees] of VECTORS.angles) {
    const found = anglesOf({ x, y, z, w });
    close(found, degrees, 1e-6, `${[x, y, z, w]}`);
  }
  assert.equal(anglesOf({ x: 0, y: 0, z: 0, w: 0 }), null);
  assert.equal(anglesText([-0.001, 89.999, 12.3456]), "0°; 90°; 12.35°");
});
