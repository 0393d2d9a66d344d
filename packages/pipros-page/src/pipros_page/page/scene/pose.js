// Poses: seven numbers, a position and a quaternion (x, y, z, w). A port of pipros_libraries.transforms.pose.

import { anglesOf, anglesText } from "../angles.js";

export const IDENTITY = Object.freeze([0, 0, 0, 0, 0, 0, 1]);

// The largest number that is drawn. Graphics cards have 32-bit floats: beyond them, bounds and the order of all objects become NaN. The
// product of two such numbers is still one.
export const MOST = 1e19;

// Returns a number within these bounds; NaN and infinity stay, because displays refuse them.
/** @type {(value: number) => number} */
export const drawable = (value) => (Number.isFinite(value) ? Math.min(MOST, Math.max(-MOST, value)) : value);

// Returns `outer * inner`.
export function composed(outer, inner) {
  const [opx, opy, opz, oqx, oqy, oqz, oqw] = outer;
  const [px, py, pz, qx, qy, qz, qw] = inner;
  if (oqw === 1 && oqx === 0 && oqy === 0 && oqz === 0) return [opx + px, opy + py, opz + pz, qx, qy, qz, qw];
  const ix = oqw * px + oqy * pz - oqz * py;
  const iy = oqw * py + oqz * px - oqx * pz;
  const iz = oqw * pz + oqx * py - oqy * px;
  const iw = oqx * px + oqy * py + oqz * pz;
  return [
    ix * oqw + iw * oqx - iy * oqz + iz * oqy + opx,
    iy * oqw + iw * oqy - iz * oqx + ix * oqz + opy,
    iz * oqw + iw * oqz - ix * oqy + iy * oqx + opz,
    oqw * qx + oqx * qw + oqy * qz - oqz * qy,
    oqw * qy + oqy * qw + oqz * qx - oqx * qz,
    oqw * qz + oqz * qw + oqx * qy - oqy * qx,
    oqw * qw - oqx * qx - oqy * qy - oqz * qz,
  ];
}

export function inverted([px, py, pz, qx, qy, qz, qw]) {
  const turned = composed([0, 0, 0, -qx, -qy, -qz, qw], [-px, -py, -pz, -qx, -qy, -qz, qw]);
  return [turned[0], turned[1], turned[2], -qx, -qy, -qz, qw];
}

/** @type {(frame: number[], point: number[]) => number[]} */
export const transformed = (frame, [x, y, z]) => composed(frame, [x, y, z, 0, 0, 0, 1]).slice(0, 3);

// Interpolates: the position linearly, the orientation by slerp along the shorter arc.
export function interpolated(older, newer, ratio) {
  const rest = 1 - ratio;
  const place = [0, 1, 2].map((axis) => rest * older[axis] + ratio * newer[axis]);
  const [from, to] = [older.slice(3), newer.slice(3)];
  if (from.every((value, i) => value === to[i])) return [...place, ...from];
  const dotted = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const dot = dotted(from, to);
  const cosine = Math.abs(dot) / Math.sqrt(dotted(from, from) * dotted(to, to));
  const angle = cosine < 1 ? Math.acos(cosine) : 0;
  if (angle === 0) return [...place, ...from];
  const sine = Math.sin(angle);
  const first = Math.sin(rest * angle) / sine;
  const second = (Math.sin(ratio * angle) / sine) * (dot < 0 ? -1 : 1);
  return [...place, ...from.map((value, i) => value * first + to[i] * second)];
}

// Returns the pose in a geometry_msgs/Pose or Transform.
export function poseOf({ position, translation, orientation, rotation }) {
  const p = position ?? translation;
  const q = orientation ?? rotation;
  return [p.x, p.y, p.z, q.x, q.y, q.z, q.w];
}

export const isFinitePose = (pose) => pose.every(Number.isFinite);

// Returns the pose with a quaternion of norm 1; one of norm 0 counts as no rotation, as in rviz.
export function normalized(pose) {
  const norm = Math.hypot(pose[3], pose[4], pose[5], pose[6]);
  return norm > 0 ? [pose[0], pose[1], pose[2], ...pose.slice(3).map((value) => value / norm)] : [pose[0], pose[1], pose[2], 0, 0, 0, 1];
}

/** @type {(pose: number[]) => number} */
export const yawOf = ([, , , x, y, z, w]) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));

// Returns the quaternion of a turn about z.
export const ofYaw = (yaw) => [0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2)];

/** @type {(values: number[]) => string} */
export const vectorText = (values) => values.map((value) => String(Number(value.toFixed(4)))).join("; ");

// Returns the names and texts of a pose's position and orientation.
export function poseTexts(pose) {
  const [x, y, z, w] = pose.slice(3);
  const angles = anglesOf({ x, y, z, w });
  return [["Position", vectorText(pose.slice(0, 3))], ["Orientation", vectorText(pose.slice(3))],
    ...(angles ? [["Roll, pitch, yaw", anglesText(angles)]] : [])];
}
