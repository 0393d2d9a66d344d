// Orientations of the controls of interactive markers.

import * as THREE from "three";

export const ORIENTATION = { inherit: 0, fixed: 1, viewFacing: 2 };

// Returns the rotation, in the marker's frame, that turns x toward the camera and z up.
function facing(camera, holder) {
  const toward = camera.getWorldDirection(new THREE.Vector3()).negate();
  const up = new THREE.Vector3(0, 1, 0).applyQuaternion(camera.quaternion);
  const side = up.clone().cross(toward);
  const turned = new THREE.Quaternion().setFromRotationMatrix(new THREE.Matrix4().makeBasis(toward, side, up));
  return turned.premultiply(holder.quaternion.clone().invert());
}

function axisOf({ orientation: { x, y, z, w } }) {
  return new THREE.Vector3(1, 0, 0).applyQuaternion(new THREE.Quaternion(x, y, z, w));
}

// Returns the orientation of a control's group in the marker's frame. `own` is the orientation of the marker.
export function groupOrientation(control, own, camera) {
  const { orientation_mode: mode, entry, independent_marker_orientation: isIndependent } = control;
  if (mode === ORIENTATION.fixed) return new THREE.Quaternion().setFromAxisAngle(axisOf(control), control.turned);
  return mode === ORIENTATION.viewFacing && !isIndependent ? facing(camera, entry.holder) : own;
}

// Returns the orientation of a marker in the fixed frame.
export function worldOrientation({ holder, pose }) {
  return holder.quaternion.clone().multiply(new THREE.Quaternion(pose[3], pose[4], pose[5], pose[6]));
}

// Returns the orientation of a control's x axis in the fixed frame.
export function controlOrientation({ entry, orientation: { x, y, z, w }, orientation_mode: mode }, camera) {
  const own = new THREE.Quaternion(x, y, z, w);
  if (mode === ORIENTATION.fixed) return entry.holder.quaternion.clone().multiply(own);
  if (mode === ORIENTATION.viewFacing) return entry.holder.quaternion.clone().multiply(facing(camera, entry.holder));
  return worldOrientation(entry).multiply(own);
}

// Returns the angle about an axis between two orientations.
export function turnAbout(axis, from, to) {
  const { x, y, z, w } = to.clone().multiply(from.clone().invert());
  return 2 * Math.atan2(axis.x * x + axis.y * y + axis.z * z, w);
}
