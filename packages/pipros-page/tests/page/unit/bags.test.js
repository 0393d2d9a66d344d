import assert from "node:assert/strict";
import test from "node:test";
import { VisibleTime } from "../page/bags/visible_time.js";

test("a shown part of a bag is shifted and shortened to fit into the bag", () => {
  const time = new VisibleTime(100, 110);
  assert.equal(time.show(95, 4), true);
  assert.deepEqual([time.first, time.span], [100, 4]);
  assert.equal(time.show(109, 4), true);
  assert.deepEqual([time.first, time.span], [106, 4]);
  assert.equal(time.show(109, 4), false);
  time.show(0, 100);
  assert.deepEqual([time.first, time.span], [100, 10]);
  time.show(105, 0);
  assert.deepEqual([time.first, time.span], [105, 0.5]);
});

test("a zoom keeps the place of its time", () => {
  const time = new VisibleTime(100, 110);
  time.zoom(0.5, 108);
  assert.deepEqual([time.first, time.span, time.percent(108)], [104, 5, "80%"]);
  time.zoom(Infinity, 108);
  assert.deepEqual([time.first, time.span], [100, 10]);
});

test("the visible part follows a moment outside of it", () => {
  const time = new VisibleTime(0, 100);
  time.show(0, 10);
  assert.equal(time.follow(10), false);
  assert.equal(time.follow(50), true);
  assert.deepEqual([time.first, time.span], [49, 10]);
});

test("ticks are at most six round times since the beginning of the bag", () => {
  const time = new VisibleTime(1000, 1011);
  assert.deepEqual(time.ticks(), [0, 2, 4, 6, 8, 10]);
  time.show(1003.5, 5);
  assert.deepEqual(time.ticks(), [4, 5, 6, 7, 8]);
});

test("times and durations are placed within the visible part", () => {
  const time = new VisibleTime(100, 110);
  time.show(102, 4);
  assert.deepEqual([time.percent(103), time.width(1)], ["25%", "25%"]);
  assert.deepEqual(time.spread(4), [102.5, 103.5, 104.5, 105.5]);
});

test("a bag of one message has a visible time", () => {
  const time = new VisibleTime(5, 5);
  assert.deepEqual([time.first, time.percent(5)], [5, "0%"]);
  assert.ok(time.span > 0);
});
