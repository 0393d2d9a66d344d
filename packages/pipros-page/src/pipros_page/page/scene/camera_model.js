// The pinhole camera in a sensor_msgs/CameraInfo.

import * as THREE from "three";

const [NEAR, FAR] = [0.01, 10000];

export class CameraModel {
  constructor({ width, height, P: p, header }) {
    this.width = width;
    this.height = height;
    this.header = header;
    this.fx = p[0];
    this.cx = p[2];
    this.fy = p[5];
    this.cy = p[6];
    this.shift = [-p[3] / p[0], -p[7] / p[5]]; // of a stereo pair's second camera, in metres along x and y
    const isValid = p.every(Number.isFinite);
    this.problem = !isValid ? "Contains invalid floating point values (nans or infs)" : p[0] === 0 || p[5] === 0
      ? "Invalid CameraInfo: fx and fy must not be 0" : "";
  }

  // Sets up a three.js camera at the pose of the camera's frame (z forward, y down), for images of width x height pixels.
  aim(camera, pose, zoom, width, height) {
    const orientation = new THREE.Quaternion(pose[3], pose[4], pose[5], pose[6]).normalize();
    const frame = new THREE.Matrix4().makeRotationFromQuaternion(orientation).setPosition(pose[0], pose[1], pose[2]);
    frame.multiply(new THREE.Matrix4().makeTranslation(this.shift[0], this.shift[1], 0));
    frame.multiply(new THREE.Matrix4().makeRotationX(Math.PI));
    camera.matrixAutoUpdate = false;
    camera.matrix.copy(frame);
    camera.updateMatrixWorld(true);
    camera.projectionMatrix.set(
      (2 * this.fx * zoom) / width, 0, zoom - (2 * this.cx * zoom) / width, 0,
      0, (2 * this.fy * zoom) / height, (2 * this.cy * zoom) / height - zoom, 0,
      0, 0, -(FAR + NEAR) / (FAR - NEAR), (-2 * FAR * NEAR) / (FAR - NEAR),
      0, 0, -1, 0,
    );
    camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
  }
}
