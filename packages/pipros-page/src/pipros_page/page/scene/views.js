// The cameras of rviz: Orbit, XYOrbit, ThirdPersonFollower, TopDownOrtho and FPS, moved by mouse, wheel and touch.

import * as THREE from "three";
import { Properties, className } from "./properties.js";
import { VIEWS } from "./schema.js";
import { yawOf } from "./pose.js";
import { SPHERE, lit } from "./shapes.js";

const PITCH_LIMIT = Math.PI / 2 - 0.001;
const FAR = 10000;
const FOCUS_MS = 400; // how long the focal point stays visible after a movement

// Returns the controller for the map `Current` of a file.
export function viewOf(config, scene) {
  const kind = className(config.Class ?? "rviz/Orbit");
  const Kind = { "rviz/XYOrbit": XYOrbit, "rviz/ThirdPersonFollower": Follower, "rviz/TopDownOrtho": TopDownOrtho, "rviz/FPS": Fps }[kind]
    ?? Orbit;
  return new Kind(new Properties(VIEWS[kind] ?? VIEWS["rviz/Orbit"], config), scene);
}

// Moves the camera of a view as rviz does for these mouse buttons.
export function moveByMouse(view, { clientWidth: width, clientHeight: height }, { buttons, shiftKey }, dx, dy) {
  if (buttons & 4 || (buttons & 1 && shiftKey)) view.pan(dx, dy, width, height);
  else if (buttons & 1) view.rotate(dx, dy);
  else if (buttons & 2 && shiftKey) view.dolly(dy * 0.1);
  else if (buttons & 2) view.zoom(-dy * 0.01);
  view.showFocus();
}

class View {
  constructor(properties, scene) {
    this.properties = properties;
    this.scene = scene;
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.01, FAR);
    this.camera.up.set(0, 0, 1);
    this.origin = [0, 0, 0, 0, 0, 0, 1]; // the last known pose of the target frame
  }

  get(name) {
    return this.properties.get(name);
  }

  set(name, value) {
    this.properties.set([name], typeof value === "number" ? Number(value.toPrecision(9)) : value);
    this.scene.invalidate();
  }

  add(name, value) {
    this.set(name, this.get(name) + value);
  }

  // Places the camera for the next picture.
  update(width, height) {
    const frame = this.get("Target Frame");
    try {
      this.origin = frame === "<Fixed Frame>" || !frame ? [0, 0, 0, 0, 0, 0, 1] : this.scene.poseOf(frame, 0n);
    } catch {
      // the camera stays at its last pose
    }
    this.camera.near = Math.max(1e-4, this.get("Near Clip Distance"));
    this.camera.far = FAR;
    this.aim(width, height);
    this.camera.updateMatrixWorld();
  }

  // Briefly shows the point about which the camera turns. Overridden by the views that have such a point.
  showFocus() {}

  // Places the camera in the target frame. Overridden by each view.
  aim(_width, _height) {}

  rotate(dx, dy) {
    this.add("Yaw", -dx * 0.005);
    this.set("Pitch", Math.min(PITCH_LIMIT, Math.max(-PITCH_LIMIT, this.get("Pitch") + dy * 0.005)));
  }

  // Metres per pixel at a distance.
  metres(height, distance) {
    return (2 * distance * Math.tan((this.camera.fov * Math.PI) / 360)) / height;
  }
}

class Orbit extends View {
  get turn() {
    return 0;
  }

  // An inverted z axis turns the camera by half a turn about an x axis through the focal point.
  get sign() {
    return this.get("Invert Z Axis") ? -1 : 1;
  }

  focus() {
    const [x, y, z] = this.get("Focal Point");
    const [cos, sin] = [Math.cos(this.turn), Math.sin(this.turn)];
    return new THREE.Vector3(this.origin[0] + cos * x - sin * y, this.origin[1] + sin * x + cos * y, this.origin[2] + z);
  }

  aim(width, height) {
    const [distance, yaw, pitch] = [Math.max(0.01, this.get("Distance")), this.get("Yaw") + this.turn, this.get("Pitch")];
    const focus = this.focus();
    const { sign } = this;
    const back = new THREE.Vector3(Math.cos(yaw) * Math.cos(pitch), sign * Math.sin(yaw) * Math.cos(pitch), sign * Math.sin(pitch));
    this.camera.up.set(0, 0, this.sign);
    this.camera.fov = Math.min(179, Math.max(0.1, (this.get("Field of View") * 180) / Math.PI));
    this.camera.aspect = width / height;
    this.camera.position.copy(focus).addScaledVector(back, distance);
    this.camera.lookAt(focus);
    this.raise(distance);
    this.camera.updateProjectionMatrix();
  }

  raise(_distance) {}

  showFocus() {
    const { scene } = this;
    scene.focus ??= new THREE.Mesh(SPHERE, lit([255, 255, 0], 0.5));
    const size = this.get("Focal Shape Size") * (this.get("Focal Shape Fixed Size") ? 1 : this.get("Distance"));
    scene.focus.scale.set(size || 1e-6, size || 1e-6, size / 5 || 1e-6);
    scene.focus.position.copy(this.focus());
    scene.world.add(scene.focus);
    clearTimeout(scene.hidingFocus);
    scene.hidingFocus = setTimeout(() => {
      scene.world.remove(scene.focus);
      scene.invalidate();
    }, FOCUS_MS);
  }

  pan(dx, dy, width, height) {
    const metres = this.metres(height, this.get("Distance"));
    this.shift(new THREE.Vector3(-dx * metres, dy * metres, 0).applyQuaternion(this.camera.quaternion));
  }

  // Moves the focal point by a vector in the fixed frame.
  shift(vector) {
    vector.applyAxisAngle(new THREE.Vector3(0, 0, 1), -this.turn);
    const [x, y, z] = this.get("Focal Point");
    this.set("Focal Point", [x + vector.x, y + vector.y, z + vector.z].map((value) => Number(value.toPrecision(9))));
  }

  zoom(amount) {
    this.set("Distance", Math.max(0.001, this.get("Distance") - amount * this.get("Distance")));
  }

  // Moves along the direction of view.
  dolly(amount) {
    this.shift(new THREE.Vector3(0, 0, -amount).applyQuaternion(this.camera.quaternion));
  }

  lookAt(point) {
    const [x, y, z] = [point.x - this.origin[0], point.y - this.origin[1], point.z - this.origin[2]];
    const [cos, sin] = [Math.cos(-this.turn), Math.sin(-this.turn)];
    const position = this.camera.position.clone();
    this.set("Focal Point", [cos * x - sin * y, sin * x + cos * y, z]);
    const back = position.sub(this.focus());
    const distance = Math.max(0.01, back.length());
    this.set("Distance", distance);
    this.set("Pitch", Math.min(PITCH_LIMIT, Math.max(-PITCH_LIMIT, Math.asin((this.sign * back.z) / distance))));
    this.set("Yaw", Math.atan2(this.sign * back.y, back.x) - this.turn);
  }

  home() {
    for (const [name, value] of [["Distance", 10], ["Yaw", 0.785398], ["Pitch", 0.785398], ["Focal Point", [0, 0, 0]]])
      this.set(name, value);
  }
}

// Moves the focal point only parallel to the ground.
class XYOrbit extends Orbit {
  raise(distance) {
    const up = new THREE.Vector3(0, 1, 0).applyQuaternion(this.camera.quaternion);
    this.camera.position.addScaledVector(up, 0.2 * distance);
  }

  shift(vector) {
    vector.z = 0;
    if (vector.length() > 1) vector.setLength(1);
    super.shift(vector);
  }
}

class Follower extends XYOrbit {
  get turn() {
    return yawOf(this.origin);
  }
}

class TopDownOrtho extends View {
  constructor(properties, scene) {
    super(properties, scene);
    this.camera = new THREE.OrthographicCamera();
    this.camera.rotation.order = "ZYX";
  }

  aim(width, height) {
    const scale = Math.max(1e-6, this.get("Scale"));
    const [right, top] = [width / 2 / scale, height / 2 / scale];
    Object.assign(this.camera, { left: -right, right, top, bottom: -top });
    this.camera.position.set(this.origin[0] + this.get("X"), this.origin[1] + this.get("Y"), 500);
    this.camera.rotation.set(0, 0, this.get("Angle"));
    this.camera.updateProjectionMatrix();
  }

  metres() {
    return 1 / this.get("Scale");
  }

  rotate(dx) {
    this.add("Angle", -dx * 0.005);
  }

  pan(dx, dy) {
    const [scale, angle] = [this.get("Scale"), this.get("Angle")];
    const [x, y] = [-dx / scale, dy / scale];
    this.add("X", Math.cos(angle) * x - Math.sin(angle) * y);
    this.add("Y", Math.sin(angle) * x + Math.cos(angle) * y);
  }

  zoom(amount) {
    this.set("Scale", Math.max(1e-3, this.get("Scale") * (1 + amount)));
  }

  dolly() {}

  lookAt(point) {
    this.set("X", point.x - this.origin[0]);
    this.set("Y", point.y - this.origin[1]);
  }

  home() {
    for (const [name, value] of [["Scale", 10], ["Angle", 0], ["X", 0], ["Y", 0]]) this.set(name, value);
  }
}

class Fps extends View {
  aim(width, height) {
    const [x, y, z] = this.get("Position");
    const [yaw, pitch] = [this.get("Yaw"), this.get("Pitch")];
    this.camera.fov = 45;
    this.camera.aspect = width / height;
    this.camera.position.set(this.origin[0] + x, this.origin[1] + y, this.origin[2] + z);
    const ahead = new THREE.Vector3(Math.cos(yaw) * Math.cos(pitch), Math.sin(yaw) * Math.cos(pitch), -Math.sin(pitch));
    this.camera.lookAt(ahead.add(this.camera.position));
    this.camera.rotateZ(-this.get("Roll"));
    this.camera.updateProjectionMatrix();
  }

  pan(dx, dy) {
    this.shift(new THREE.Vector3(dx * 0.01, -dy * 0.01, 0));
  }

  zoom(amount) {
    this.dolly(amount * 10);
  }

  dolly(amount) {
    this.shift(new THREE.Vector3(0, 0, -amount));
  }

  shift(vector) {
    vector.applyQuaternion(this.camera.quaternion);
    const [x, y, z] = this.get("Position");
    this.set("Position", [x + vector.x, y + vector.y, z + vector.z]);
  }

  lookAt(point) {
    const along = new THREE.Vector3().subVectors(point, this.camera.position);
    this.set("Yaw", Math.atan2(along.y, along.x));
    this.set("Pitch", Math.atan2(-along.z, Math.hypot(along.x, along.y)));
  }

  home() {
    for (const [name, value] of [["Position", [0, 0, 0]], ["Yaw", 0], ["Pitch", 0]]) this.set(name, value);
  }
}
