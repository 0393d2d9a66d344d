// Forces and orientations: WrenchStamped, and Imu of the package rviz_imu_plugin.

import * as THREE from "three";
import { inverted, isFinitePose, normalized } from "../pose.js";
import { BOX, arrow, axes, lit, place, segments, wideLines } from "../shapes.js";
import { Placed } from "./poses.js";

const X = new THREE.Vector3(1, 0, 0);
const Z = new THREE.Vector3(0, 0, 1);
const RING = { parts: 32, from: 4 }; // the ring of a torque has a gap at its start

const vectorOf = ({ x, y, z }) => new THREE.Vector3(x, y, z);
const isFinite = (vector) => vector.toArray().every(Number.isFinite);

export class WrenchStamped extends Placed {
  get most() {
    return Math.max(1, this.get("History Length"));
  }

  draw({ wrench }) {
    const [force, torque] = [vectorOf(wrench.force), vectorOf(wrench.torque)];
    if (!isFinite(force) || !isFinite(torque)) return this.refuse();
    const group = new THREE.Group();
    const [alpha, width] = [this.get("Alpha"), this.get("Arrow Width")];
    const add = (vector, scale, colour) => {
      const length = vector.length() * scale;
      if (!(length > 0) || (this.get("Hide Small Values") && length < width)) return 0;
      group.add(straightArrow(vector, length, width, lit(colour, alpha)));
      return length;
    };
    add(force, this.get("Force Arrow Scale"), this.get("Force Color"));
    const colour = this.get("Torque Color");
    const length = add(torque, this.get("Torque Arrow Scale"), colour);
    if (length) group.add(ring(torque, length, width, colour, alpha));
    return group;
  }
}

function straightArrow(vector, length, width, material) {
  const shape = arrow(length, 0.1 * width, 0.3 * length, 0.2 * width, material);
  shape.quaternion.setFromUnitVectors(X, vector.clone().normalize());
  return shape;
}

// The ring around the arrow of a torque, with a head that shows the direction of the turn.
function ring(torque, length, width, colour, alpha) {
  const radius = length / 4;
  const strip = [];
  for (let part = RING.from; part <= RING.parts; part += 1) {
    const angle = (part * 2 * Math.PI) / RING.parts;
    strip.push(radius * Math.cos(angle), radius * Math.sin(angle), length / 2);
  }
  const group = new THREE.Group();
  group.add(wideLines(segments(strip), 0.05 * width, [...colour.map((part) => part / 255), alpha], alpha < 0.9998));
  const head = arrow(0, 0.1 * width, 0.1 * width, 0.2 * width, lit(colour, alpha));
  head.position.set(radius, 0, length / 2);
  head.rotation.z = Math.PI / 2;
  group.add(head);
  group.quaternion.setFromUnitVectors(Z, torque.clone().normalize());
  return group;
}

export class Imu extends Placed {
  draw({ orientation, linear_acceleration: linear }, pose) {
    const own = [0, 0, 0, orientation.x, orientation.y, orientation.z, orientation.w];
    const acceleration = vectorOf(linear);
    if (!isFinitePose(own) || !isFinite(acceleration)) return this.refuse();
    const turned = normalized(own);
    const holder = new THREE.Group();
    // The orientation is relative to the fixed frame, or to that of the sensor.
    if (this.get("fixed_frame_orientation")) place(holder, inverted([0, 0, 0, pose[3], pose[4], pose[5], pose[6]]));
    const group = new THREE.Group();
    place(group, turned);
    holder.add(group);
    const box = (name) => this.get("Box properties", name);
    if (box("Enable box")) {
      const mesh = new THREE.Mesh(BOX, lit(box("Box color"), box("Box alpha")));
      mesh.scale.set(box("x_scale") || 1e-6, box("y_scale") || 1e-6, box("z_scale") || 1e-6);
      group.add(mesh);
    }
    const scale = this.get("Axes properties", "Axes scale");
    if (this.get("Axes properties", "Enable axes")) group.add(axes(scale, 0.1 * scale));
    const arrowOf = (name) => this.get("Acceleration properties", name);
    const length = acceleration.length() * arrowOf("Acc. vector scale");
    if (arrowOf("Enable acceleration") && length > 0) {
      const shape = straightArrow(acceleration, length, length, lit(arrowOf("Acc. vector color"), arrowOf("Acc. vector alpha")));
      (arrowOf("Derotate acceleration") ? group : holder).add(shape);
    }
    return holder;
  }
}
