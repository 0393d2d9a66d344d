// How a control moves its marker with the mouse. Poses are in the fixed frame.

import * as THREE from "three";

export const MODE = {
  none: 0, menu: 1, button: 2, moveAxis: 3, movePlane: 4, rotateAxis: 5, moveRotate: 6, move3d: 7, rotate3d: 8, moveRotate3d: 9,
};
const TURN_PIXELS = 300; // pixels that the mouse moves for a whole turn
const PROBE_PIXELS = 10; // the distance that measures the size of a pixel

// A drag of one control.
//   mode: the interaction mode
//   position, orientation: of the marker when it was grabbed (Vector3, Quaternion)
//   axis: the control's x axis (a unit Vector3)
//   grip: the point that was grabbed
export class Drag {
  constructor(mode, position, orientation, axis, grip, pixel) {
    this.mode = mode;
    this.axis = axis;
    this.grip = grip;
    this.pixel = pixel;
    this.firstPixel = pixel;
    // How far the mouse has moved while turning or pushing the marker. rviz then moves the cursor back; a page cannot.
    this.moved = [0, 0];
    this.start = { position: position.clone(), orientation: orientation.clone() };
    this.position = position.clone();
    this.orientation = orientation.clone();
  }

  // Moves to a pixel. `keys` has shiftKey and ctrlKey. Returns whether the pose has changed.
  move(mouse, camera, width, height, keys) {
    const pixel = this.cursor(mouse);
    const ray = rayAt(pixel, camera, width, height);
    const [dx, dy] = [pixel[0] - this.pixel[0], pixel[1] - this.pixel[1]];
    const { mode } = this;
    const isTurning = mode === MODE.rotate3d || (mode === MODE.moveRotate3d && keys.ctrlKey);
    const isPushing = !isTurning && mode >= MODE.move3d && keys.shiftKey;
    const before = [...this.position.toArray(), ...this.orientation.toArray()];
    if (mode === MODE.moveAxis) this.alongAxis(pixel, camera, width, height);
    else if (mode === MODE.movePlane) this.inPlane(ray, this.axis);
    else if (mode === MODE.rotateAxis) this.around(ray);
    else if (mode === MODE.moveRotate) this.pull(ray);
    else if (isTurning) this.turn(camera, dx, dy);
    else if (isPushing) this.inDepth(dy, camera, width, height);
    else if (mode >= MODE.move3d) this.inView(ray, camera);
    if (isTurning || isPushing) this.moved = [this.moved[0] + dx, this.moved[1] + dy];
    else this.pixel = pixel;
    return [...this.position.toArray(), ...this.orientation.toArray()].some((value, i) => value !== before[i]);
  }

  /** Returns where the cursor of rviz would be. @param {number[]} mouse @returns {[number, number]} */
  cursor([x, y]) {
    return [x - this.moved[0], y - this.moved[1]];
  }

  // First projects the mouse onto the axis as it appears in the picture.
  alongAxis(pixel, camera, width, height) {
    const [from, to] = [this.grip, this.grip.clone().add(this.axis)].map((point) => {
      const seen = point.clone().project(camera);
      return new THREE.Vector2(((seen.x + 1) / 2) * width, ((1 - seen.y) / 2) * height);
    });
    const along = to.clone().sub(from);
    if (along.lengthSq() < 1e-6) return;
    const mouse = new THREE.Vector2(pixel[0] + 0.5, pixel[1] + 0.5).sub(from);
    const nearest = from.clone().addScaledVector(along, mouse.dot(along) / along.lengthSq());
    const ray = rayAt([nearest.x - 0.5, nearest.y - 0.5], camera, width, height);
    // The point of the axis that is nearest to the ray.
    const gap = this.grip.clone().sub(ray.origin);
    const mixed = this.axis.dot(ray.direction);
    const slope = 1 - mixed * mixed;
    if (slope < 1e-9) return;
    const distance = (mixed * ray.direction.dot(gap) - this.axis.dot(gap)) / slope;
    this.position.copy(this.start.position).addScaledVector(this.axis, distance);
  }

  inPlane(ray, normal) {
    const there = meeting(ray, normal, this.grip);
    if (there) this.position.copy(this.start.position).add(there.sub(this.grip));
  }

  around(ray) {
    const there = meeting(ray, this.axis, this.grip);
    if (!there) return;
    const angle = angleAbout(this.axis, this.grip.clone().sub(this.start.position), there.sub(this.start.position));
    this.orientation.setFromAxisAngle(this.axis, angle).multiply(this.start.orientation);
  }

  // The grabbed point follows the mouse: the marker turns toward it, and moves by the rest.
  pull(ray) {
    const there = meeting(ray, this.axis, this.grip);
    if (!there) return;
    const arm = this.grip.clone().sub(this.position);
    const wanted = there.clone().sub(this.position);
    const turned = new THREE.Quaternion().setFromAxisAngle(this.axis, angleAbout(this.axis, arm, wanted));
    this.orientation.premultiply(turned);
    this.position.add(wanted.sub(arm.applyQuaternion(turned)));
    this.grip = there;
  }

  turn(camera, dx, dy) {
    const up = new THREE.Vector3(0, 1, 0).applyQuaternion(camera.quaternion);
    const right = new THREE.Vector3(1, 0, 0).applyQuaternion(camera.quaternion);
    const turned = new THREE.Quaternion().setFromAxisAngle(up, (dx * 2 * Math.PI) / TURN_PIXELS);
    turned.multiply(new THREE.Quaternion().setFromAxisAngle(right, (dy * 2 * Math.PI) / TURN_PIXELS));
    this.orientation.premultiply(turned);
  }

  inView(ray, camera) {
    const there = meeting(ray, camera.getWorldDirection(new THREE.Vector3()), this.grip);
    if (!there) return;
    this.position.add(there.clone().sub(this.grip));
    this.grip = there;
  }

  // Moves along the ray of the first pixel, as far as the mouse moves in the plane of the picture at the grip.
  inDepth(dy, camera, width, height) {
    const [x, y] = this.firstPixel;
    const [ray, beside] = [0, PROBE_PIXELS].map((more) => rayAt([x, y + more], camera, width, height));
    const facing = camera.getWorldDirection(new THREE.Vector3());
    const [here, there] = [ray, beside].map((each) => meeting(each, facing, this.grip));
    if (!here || !there) return;
    const step = ray.direction.clone().multiplyScalar((-dy * here.distanceTo(there)) / PROBE_PIXELS);
    this.position.add(step);
    this.grip = this.grip.clone().add(step);
  }
}

export function rayAt([x, y], camera, width, height) {
  const caster = new THREE.Raycaster();
  caster.setFromCamera(new THREE.Vector2(((x + 0.5) / width) * 2 - 1, 1 - ((y + 0.5) / height) * 2), camera);
  return caster.ray;
}

function meeting(ray, normal, point) {
  if (Math.abs(ray.direction.dot(normal)) < 1e-3) return null;
  return ray.intersectPlane(new THREE.Plane().setFromNormalAndCoplanarPoint(normal, point), new THREE.Vector3());
}

// Returns the angle from one vector to another about an axis.
function angleAbout(axis, from, to) {
  const [a, b] = [from, to].map((vector) => vector.clone().projectOnPlane(axis));
  return Math.atan2(axis.dot(a.clone().cross(b)), a.dot(b));
}
