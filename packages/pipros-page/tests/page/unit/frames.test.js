import assert from "node:assert/strict";
import test from "node:test";
import { Frames, TransformError, seconds } from "../page/scene/frames.js";
import { normalized, ofYaw, poseOf, poseTexts, transformed, yawOf } from "../page/scene/pose.js";
import { explanation, fixedFrameStatus, otherRoots, whyNot } from "../page/scene/transform_texts.js";
import { VECTORS, close } from "./vectors.js";

const SECOND = 1000000000n;
const HERE = [1, 2, 3, 0, 0, 0, 1];

function filled(links) {
  const frames = new Frames();
  for (const [parent, child, time, isStatic = false] of links)
    assert.ok(frames.insert(parent, child, BigInt(time) * SECOND, HERE, "/sender", isStatic));
  return frames;
}

test("lookups have the poses and errors of the library", () => {
  const frames = new Frames();
  for (const [parent, child, stamp, pose, isStatic] of VECTORS.frames.inserts)
    frames.insert(parent, child, BigInt(stamp), pose, "test", isStatic);
  let failed = 0;
  for (const [target, source, time, expected] of VECTORS.frames.lookups) {
    const about = `${source} in ${target} at ${time}`;
    let found;
    try {
      found = frames.lookup(target, source, BigInt(time));
    } catch (error) {
      assert.ok(error instanceof TransformError, about);
      found = [error.kind, error.message];
    }
    if (expected.length === 2) {
      failed += 1;
      assert.deepEqual(found, expected, about);
    } else close(found, expected, 1e-9, about);
  }
  const part = failed / VECTORS.frames.lookups.length;
  assert.ok(part > 0.1 && part < 0.9);
});

test("impossible transforms are refused", () => {
  const frames = new Frames();
  for (const [parent, child, pose, stamp] of [
    ["a", "a", HERE, 1n], ["", "b", HERE, 1n], ["a", "b", [NaN, 0, 0, 0, 0, 0, 1], 1n], ["a", "b", [0, 0, 0, 0, 0, 0, 2], 1n],
      ["a", "b", HERE, -1n],
  ]) assert.equal(frames.insert(parent, child, stamp, pose), false);
  assert.deepEqual(frames.names(), []);
});

test("a loop is an error, not an endless walk", () => {
  const frames = filled([["a", "b", 1], ["b", "a", 1], ["a", "c", 1]]);
  assert.throws(() => frames.lookup("missing_root", "c", 0n), { kind: "LookupException" });
  frames.insert("x", "y", SECOND, HERE);
  assert.throws(() => frames.lookup("y", "c", 0n), /contains a loop/);
  assert.throws(() => frames.lookup("y", "c", SECOND), /contains a loop/);
  assert.match(explanation(frames, "y", "c", 0n), /contains a loop/);
});

test("static frames survive clear", () => {
  const frames = filled([["/map", "odom", 1, true], ["odom", "base", 5]]);
  frames.clear();
  assert.deepEqual([...frames.lookup("map", "odom", 0n)], HERE);
  assert.throws(() => frames.lookup("map", "base", 0n), TransformError);
  assert.equal(frames.newestStamp("odom"), 0n);
  assert.equal(frames.authority("odom"), "/sender");
  assert.equal(frames.parent("odom"), "map");
});

test("texts name the frame, the cause and the remedy", () => {
  const frames = filled([["map", "odom", 1], ["odom", "base", 90], ["other", "island", 90]]);
  const error = new Error("why");
  assert.equal(whyNot(frames, "map", "x", error), "For frame [x]: Frame [x] does not exist");
  assert.equal(whyNot(frames, "x", "map", error), "For frame [map]: Fixed Frame [x] does not exist");
  assert.match(whyNot(frames, "map", "base", error), /TF error: \[why\]$/);
  assert.deepEqual(fixedFrameStatus(new Frames(), "map", ""), ["warning", "No TF data"]);
  assert.deepEqual(fixedFrameStatus(frames, "map", ""), ["ok", "OK"]);
  assert.deepEqual(fixedFrameStatus(frames, "map", "bad"), ["warning", "bad"]);
  assert.deepEqual(fixedFrameStatus(frames, "x", ""), ["error", "Unknown frame x"]);
  assert.equal(explanation(frames, "map", "x", 0n), "");
  assert.match(explanation(frames, "map", "island", 0n), /in the tree of \[other\]/);
  const later = performance.now() + 5000;
  assert.match(explanation(frames, "map", "base", 100n * SECOND, later),
    /from \[odom\] to \[map\], sent by \[\/sender\], is 99 s old; its sender may have stopped\.$/);
  assert.match(explanation(frames, "map", "base", 100n * SECOND), /is 99 s old; newer ones still arrive: this browser is slow, or/);
  assert.equal(explanation(frames, "map", "base", 2n * SECOND), "");
  assert.equal(explanation(filled([["a", "b", 0, true]]), "a", "b", 0n), "");
  assert.deepEqual(otherRoots(frames, "map"), ["other"]);
  assert.deepEqual(otherRoots(filled([["a", "b", 1], ["b", "a", 1]]), "map"), []);
  assert.equal(seconds(1234567890123n), "1234.567890123");
});

test("poses are converted", () => {
  close([yawOf([0, 0, 0, ...ofYaw(0.7)])], [0.7], 1e-12, "yaw");
  close(transformed([1, 0, 0, ...ofYaw(Math.PI / 2)], [1, 0, 0]), [1, 1, 0], 1e-12, "a point");
  const [position, orientation] = [{ x: 1, y: 2, z: 3 }, { x: 0, y: 0, z: 0, w: 2 }];
  assert.deepEqual(normalized(poseOf({ position, orientation })), HERE);
  assert.deepEqual(normalized(poseOf({ translation: position, rotation: { x: 0, y: 0, z: 0, w: 0 } })), HERE);
  assert.deepEqual(poseTexts(HERE), [["Position", "1; 2; 3"], ["Orientation", "0; 0; 0; 1"], ["Roll, pitch, yaw", "0°; 0°; 0°"]]);
});
