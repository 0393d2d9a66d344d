import assert from "node:assert/strict";
import test from "node:test";
import * as THREE from "three";
import { CameraModel } from "../page/scene/camera_model.js";
import { transformed } from "../page/scene/pose.js";
import { VECTORS, close } from "./vectors.js";

const SIZE = { width: 640, height: 480 };

test("points are drawn at the pixels that image_geometry computes", () => {
  for (const { P, pose, points, pixels } of VECTORS.cameras) {
    const model = new CameraModel({ ...SIZE, P, header: {} });
    assert.equal(model.problem, "");
    const camera = new THREE.PerspectiveCamera();
    model.aim(camera, pose, 1, SIZE.width, SIZE.height);
    points.forEach((point, index) => {
      const seen = new THREE.Vector3(...transformed(pose, point)).project(camera);
      close([((seen.x + 1) / 2) * SIZE.width, ((1 - seen.y) / 2) * SIZE.height], pixels[index], 1e-6, `${point}`);
    });
  }
});

test("cameras that cannot be drawn say why", () => {
  const problemOf = (P) => new CameraModel({ ...SIZE, P, header: {} }).problem;
  assert.match(problemOf([0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]), /fx and fy must not be 0/);
  assert.match(problemOf([NaN, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]), /invalid floating point values/);
});
