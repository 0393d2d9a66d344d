import assert from "node:assert/strict";
import test from "node:test";
import { curveText, curveTexts, parsedCurve, parsedPlot, plotText } from "../page/plot/curve_text.js";
import { VECTORS, close } from "./vectors.js";

globalThis.matchMedia = () => /** @type {any} */ ({ matches: false });
const { Curve, pairs } = await import("../page/plot/curve.js");

function filled(text, samples) {
  const curve = new Curve(text, 0);
  curve.take({ samples });
  return curve;
}

test("derivatives and crossed curves have numpy's values", () => {
  for (const { samples, others, rates, pairs: expected } of VECTORS.plots) {
    const curve = filled("/a", samples);
    assert.deepEqual(curve.values, samples.map(([, value]) => value));
    const rate = filled("/a;d", samples);
    assert.equal(rate.values.length, rates.length);
    rate.values.forEach((value, index) => (value === null ? assert.equal(rates[index], null)
      : close([value], [rates[index]], 1e-9, "rate")));
    const found = pairs(curve, filled("/b", others), [0, 100]);
    assert.equal(found.length, expected.length);
    found.forEach((pair, index) => (pair === null ? assert.equal(expected[index], null) : close(pair, expected[index], 1e-9, "pair")));
  }
});

test("samples from before the newest are dropped, and old ones make room", () => {
  const curve = filled("/a", [[1, 1], [0.5, 9], [2, 2]]);
  assert.deepEqual(curve.times, [1, 2]);
  assert.deepEqual([curve.at(1.5), curve.at(null), curve.at(0)], [1, 2, undefined]);
  curve.take({ samples: Array.from({ length: 70000 }, (_, index) => [3 + index, index]), lost: 4, error: "slow" });
  assert.deepEqual([curve.times.length, curve.values.at(-1), curve.lost, curve.problem], [50000, 69999, 4, "slow"]);
  assert.match(curve.colour, /^#[0-9a-f]{6}$/);
  assert.deepEqual(filled("/a;d", [[1, 1], [1, 5], [2, 3]]).values, [2]);
});

test("texts of curves are read and written", () => {
  assert.deepEqual(curveTexts("imu/x:y:z;d, /a=f(m.x, m.y) /b"), ["/imu/x;d", "/imu/y;d", "/imu/z;d", "/a=f(m.x, m.y) /b"]);
  assert.deepEqual(curveTexts("/a /b"), ["/a", "/b"]);
  assert.deepEqual(curveTexts("/a=m['x,y'],/c"), ["/a=m['x,y']", "/c"]);
  const curve = parsedCurve("/odom/x;d;r");
  assert.deepEqual(curve, { field: "/odom/x", isRate: true, isRight: true });
  assert.equal(curveText(curve), "/odom/x;d;r");
  const text = plotText(["/a", "/b;d"], "xy", true);
  assert.deepEqual(parsedPlot(text), { curves: ["/a", "/b;d"], axis: "xy", hasMarks: true });
  assert.deepEqual(parsedPlot("/a"), { curves: ["/a"], axis: "received", hasMarks: false });
});
