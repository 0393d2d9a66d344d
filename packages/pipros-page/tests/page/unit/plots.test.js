import assert from "node:assert/strict";
import test from "node:test";
import { conditionOf, curveText, curveTexts, parsedCurve, parsedPlot, plotText, withCondition } from "../page/plot/curve_text.js";
import { axisLabels, csvOf, nearestTime, number, rangeAfter, samplesIn, statistics } from "../page/plot/selection.js";
import { VECTORS, close } from "./vectors.js";

globalThis.matchMedia = () => /** @type {any} */ ({ matches: false });
const { Curve, pairs } = await import("../page/plot/curve.js");

function filled(text, samples) {
  const curve = new Curve(text, 0);
  curve.take({ samples });
  return curve;
}

test("derivatives and x-y curves have numpy's values", () => {
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

test("the labels of an axis differ, also for tiny values and small steps", () => {
  assert.deepEqual(axisLabels([0, 5e-16, 1e-15], 5e-16), ["0", "5e-16", "1e-15"]);
  assert.deepEqual(axisLabels([1000.05, 1000.1], 0.05), ["1000.05", "1000.1"]);
  assert.deepEqual(axisLabels([0, 0.1, 0.30000000000000004], 0.1), ["0", "0.1", "0.3"]);
  assert.deepEqual(axisLabels([-20000, 0], 20000), ["-20000", "0"]);
  assert.deepEqual(axisLabels([3 * 2e307, 1.75e308, -7e291], 2.5e307), ["6e+307", "1.75e+308", "0"]);
});

test("samples older than the newest are dropped, and old ones make room", () => {
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
  const usual = { axis: "received", hasMarks: false, hasStatistics: false, lines: [], at: null };
  const text = plotText(["/a", "/b;d"], "xy", true, { hasStatistics: true, lines: [2.5, -1e-9] });
  assert.deepEqual(parsedPlot(text), { ...usual, curves: ["/a", "/b;d"], axis: "xy", hasMarks: true, hasStatistics: true,
    lines: [2.5, -1e-9] });
  assert.deepEqual(parsedPlot("/a"), { ...usual, curves: ["/a"] });
  assert.deepEqual(parsedPlot("at:12.5"), { ...usual, curves: [], at: 12.5 });
  assert.deepEqual(parsedPlot("line:high,/a"), { ...usual, curves: ["/a"] });
});

test("conditions are read, replaced and removed", () => {
  const field = '/tf{m.id == "}," and f({1}) > 2}/x';
  assert.deepEqual(curveTexts(`${field}, /b`), [field, "/b"]);
  assert.equal(conditionOf(field), 'm.id == "}," and f({1}) > 2');
  assert.deepEqual(["/a/x", "/a=m.x", "/a{m.y"].map(conditionOf), ["", "", "m.y"]);
  assert.equal(withCondition("/a/pose/x", "/a", "m.y > 1"), "/a{m.y > 1}/pose/x");
  assert.equal(withCondition("/a{m.y > 1}/pose/x", "/a", "m.z"), "/a{m.z}/pose/x");
  assert.equal(withCondition("/a{m.y > 1}=m.x", "/a", ""), "/a=m.x");
  assert.deepEqual(["/a{m.b}/c", "/a=m.b", "/a/b"].map((each) => new Curve(each, 0).topic), ["/a", "/a", "/a"]);
});

const samples = (text, values) => ({ text, times: values.map((_, index) => index), values });

test("the nearest sample is that of any curve, if it is near enough", () => {
  const curves = [samples("/a", [1, 2, 3]), { times: [1.4, 9], values: [0, 0] }];
  assert.deepEqual([[1.3, 1], [1.1, 1], [-4, 1], [9.5, 1], [5, 2.9]].map(([time, most]) => nearestTime(curves, time, most)),
    [1.4, 1, null, 9, null]);
});

test("statistics are those of the samples in the range", () => {
  const curve = samples("/a", [5, 2, null, 6, 4]);
  assert.deepEqual(statistics(curve, [1, 4]),
    { count: 3, least: 2, most: 6, mean: 4, deviation: Math.sqrt(8 / 3), change: 2, rate: 2 / 3 });
  assert.deepEqual(samplesIn(curve, null).length, 4);
  assert.equal(statistics(curve, [2, 2.5]), null);
  assert.equal(statistics(curve, [0, 0.5]).rate, null);
});

test("keys move and zoom the range, and follow again", () => {
  const range = { min: 0, max: 10 };
  assert.deepEqual(["ArrowRight", "-", "0", "x"].map((key) => rangeAfter(key, range)), [[2, 12], [-2.5, 12.5], null, undefined]);
  assert.deepEqual([number(undefined), number(1 / 3)], ["–", "0.3333333"]);
});

test("a CSV table has the samples in the range, with quoted names", () => {
  assert.equal(csvOf([samples('/a="x",1', [1, null, 3])], [1, 2]), 'time,field,value\n1,"/a=""x"",1",\n2,"/a=""x"",1",3\n');
  assert.equal(csvOf([samples("/a", [1])], null), "time,field,value\n0,/a,1\n");
});

test("integers that the curve rounds are shown and saved exactly", () => {
  const curve = new Curve("/count/data", 0);
  curve.take({ samples: [[1, 5], [2, 2 ** 64, "18446744073709551615"], [3, 123456789], [4, -0], [5, 0.123456789]] });
  assert.deepEqual([1, 2, 3, 4, null].map((time) => curve.textAt(time)),
    ["5", "18446744073709551615 (the curve is rounded)", "123456789", "-0.0", "0.1234568"]);
  assert.match(csvOf([curve], null), /^2,\/count\/data,18446744073709551615$/m);
});

test("a pause of more than ten intervals and three seconds interrupts a curve", () => {
  const curve = new Curve("/x/data", 0);
  curve.take({ samples: Array.from({ length: 10 }, (_, index) => [index / 10, index]) });
  curve.take({ samples: [[1, 1], [5, 2], [5.1, 3]] });
  assert.deepEqual(curve.values.slice(-4), [1, null, 2, 3]);
  assert.ok(Math.abs(curve.times.at(-3) - 3) < 1e-9);
  const rare = new Curve("/y/data", 0);
  rare.take({ samples: [0, 10, 20, 31, 40, 50, 60, 150, 400].map((time) => [time, time]) });
  assert.deepEqual(rare.values.slice(-4), [60, 150, null, 400]);
});
