import assert from "node:assert/strict";
import test from "node:test";
import { KINDS, Marks } from "../page/bags/marks.js";

function example() {
  const marks = new Marks();
  marks.add([[20, "log", "late"], [5, "error", "early"]], 3);
  marks.setNotes([{ time: 10, text: "here" }]);
  return marks;
}

test("marks of all kinds are in chronological order, and have a sign and a name", () => {
  const marks = example();
  assert.deepEqual(marks.all.map(({ time, kind }) => [time, kind]), [[5, "error"], [10, "note"], [20, "log"]]);
  assert.ok(marks.all.every(({ kind }) => KINDS[kind].length === 2));
  assert.equal(marks.lost, 3);
});

test("the next and the previous mark are those beside the moment, even at a mark", () => {
  const marks = example();
  const times = (moment) => [marks.next(moment, -1)?.time, marks.next(moment, 1)?.time];
  assert.deepEqual(times(0), [undefined, 5]);
  assert.deepEqual(times(10), [5, 20]);
  assert.deepEqual(times(10.0001), [5, 20]);
  assert.deepEqual(times(21), [20, undefined]);
});

test("the marks at a moment are found although the moment was rounded", () => {
  const marks = example();
  assert.deepEqual(marks.at(10.0001).map(({ text }) => text), ["here"]);
  assert.deepEqual(marks.at(10.1), []);
});

test("notes are replaced, and a new bag has no marks", () => {
  const marks = example();
  marks.setNotes([]);
  assert.equal(marks.all.length, 2);
  marks.clear();
  assert.deepEqual([marks.all, marks.lost], [[], 0]);
});
