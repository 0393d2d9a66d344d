import assert from "node:assert/strict";
import test from "node:test";
import * as THREE from "three";
import { moveByMouse, viewOf } from "../page/scene/views.js";
import { VECTORS, close } from "./vectors.js";

const SIZE = { clientWidth: 640, clientHeight: 480 };
const scene = () => ({ invalidate() {}, poseOf: () => [1, 2, 3, 0, 0, Math.sin(0.5), Math.cos(0.5)], world: { add() {}, remove() {} } });
const vector = (each) => Object.fromEntries(["X", "Y", "Z"].map((name, index) => [name, String(each[index])]));

function made(kind, values) {
  const texts = Object.entries(values).map(([name, value]) => [name, Array.isArray(value) ? vector(value) : String(value)]);
  const view = viewOf({ Class: `rviz/${kind}`, ...Object.fromEntries(texts) }, scene());
  view.showFocus = () => {};
  view.update(SIZE.clientWidth, SIZE.clientHeight);
  return view;
}

function move(view, kind, dx, dy) {
  const buttons = { rotate: 1, zoom: 2, pan: 4 }[kind];
  moveByMouse(view, SIZE, { buttons, shiftKey: false }, dx, dy);
  view.update(SIZE.clientWidth, SIZE.clientHeight);
}

test("mouse movements move the camera as the formulas of an orbit do", () => {
  for (const { start, steps, states } of VECTORS.views) {
    const view = made("Orbit", { "Field of View": Math.PI / 4, ...start });
    steps.forEach(([kind, dx, dy], index) => {
      move(view, kind, dx, dy);
      const [position, focus] = states[index];
      close(view.camera.position.toArray(), position, 1e-5, `camera after ${kind} ${dx} ${dy}`);
      close(view.focus().toArray(), focus, 1e-5, `focal point after ${kind} ${dx} ${dy}`);
      const ahead = new THREE.Vector3().copy(view.focus()).project(view.camera);
      close([ahead.x, ahead.y], [0, 0], 1e-6, "the focal point is in the middle");
    });
  }
});

for (const kind of ["Orbit", "XYOrbit", "ThirdPersonFollower", "FPS"])
  test(`${kind} looks at a point that was clicked, and returns home`, () => {
  const view = made(kind, { "Target Frame": "base" });
  const point = new THREE.Vector3(4, -3, 0.5);
  view.lookAt(point.clone());
  view.update(SIZE.clientWidth, SIZE.clientHeight);
  const isFlat = kind === "XYOrbit" || kind === "ThirdPersonFollower"; // these raise the camera
  const seen = point.clone().project(view.camera);
  close(isFlat ? [seen.x] : [seen.x, seen.y], isFlat ? [0] : [0, 0], 1e-5, kind);
  view.dolly(1);
  view.home();
  assert.equal(view.get("Yaw"), kind === "FPS" ? 0 : 0.785398);
});

test("XYOrbit keeps its focal point at the same height", () => {
  const view = made("XYOrbit", { "Focal Point": [1, 2, 3] });
  view.pan(50, 80, SIZE.clientWidth, SIZE.clientHeight);
  view.dolly(5);
  assert.equal(view.get("Focal Point")[2], 3);
});

test("TopDownOrtho shows as many metres as its scale says", () => {
  const view = made("TopDownOrtho", { Scale: 50, X: 1, Y: 2 });
  const right = new THREE.Vector3(1 + 6.4, 2 + 4.8, 0).project(view.camera);
  close([right.x, right.y], [1, 1], 1e-9, "a corner");
  view.pan(50, 0);
  assert.equal(view.get("X"), 0);
  view.rotate(100);
  view.zoom(1);
  assert.deepEqual([view.get("Angle"), view.get("Scale")], [-0.5, 100]);
  view.lookAt(new THREE.Vector3(7, 8, 9));
  assert.deepEqual([view.get("X"), view.get("Y")], [7, 8]);
  view.home();
  assert.equal(view.get("Scale"), 10);
});

test("FPS turns where it stands, and walks where it looks", () => {
  const view = made("FPS", { Position: [1, 2, 3], Yaw: 0, Pitch: 0 });
  view.dolly(2);
  close(view.get("Position"), [3, 2, 3], 1e-9, "ahead");
  move(view, "rotate", -100, 1e6);
  close([view.get("Yaw"), view.get("Pitch")], [0.5, Math.PI / 2 - 0.001], 1e-6, "turned");
  move(view, "pan", 0, 100);
  move(view, "zoom", 0, -10);
});

test("a target frame without a pose leaves the camera where it is", () => {
  const view = made("Orbit", { "Target Frame": "base" });
  const before = view.camera.position.toArray();
  view.scene.poseOf = () => { throw new Error("no transform"); };
  view.update(SIZE.clientWidth, SIZE.clientHeight);
  assert.deepEqual(view.camera.position.toArray(), before);
});
