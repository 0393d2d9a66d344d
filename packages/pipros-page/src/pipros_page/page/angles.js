// Roll, pitch and yaw of quaternions, as pipros_libraries.transforms.pose computes them.

// Returns roll, pitch and yaw in degrees; null for a quaternion that is no rotation.
/** @type {(quaternion: { x: number, y: number, z: number, w: number }) => number[] | null} */
export function anglesOf({ x, y, z, w }) {
  const scale = 2 / (x * x + y * y + z * z + w * w);
  if (!Number.isFinite(scale)) return null;
  const sine = scale * (w * y - x * z);
  const [cosine, along] = [1 - scale * (y * y + z * z), scale * (x * y + w * z)];
  const angles = Math.abs(sine) < 1
    ? [Math.atan2(scale * (y * z + w * x), 1 - scale * (x * x + y * y)), Math.asin(sine), Math.atan2(along, cosine)]
    // In gimbal lock, roll and yaw have the same axis.
    : [Math.atan2(sine * scale * (x * y - w * z), sine * scale * (x * z + w * y)), (Math.sign(sine) * Math.PI) / 2, 0];
  return angles.map((angle) => (angle * 180) / Math.PI);
}

export const anglesText = (angles) => angles.map((angle) => `${Number(angle.toFixed(2)) || 0}°`).join("; ");
