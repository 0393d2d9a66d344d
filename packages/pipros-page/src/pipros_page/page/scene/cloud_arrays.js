// Turns the columns of a cloud into what is drawn: positions and colours. Also runs in a worker, so it imports no three.js.

import { cloudColours, finiteOnly, usableTransformer } from "./cloud_colours.js";
import { composed } from "./pose.js";

const AXES = ["x", "y", "z"];

// Returns {count, columns, positions, tints, transformer, hasAlpha}.
//   columns: name to a typed array, as `columnsOf` returns them
//   options: those of `cloudColours`; `transformer`, the property; `axis`, `isFixed` and `pose` for colours by an axis
export function cloudArrays(columns, options) {
  const finite = finiteOnly(columns);
  const [xs, ys, zs] = AXES.map((name) => finite.get(name));
  const count = xs.length;
  const positions = new Float32Array(count * 3);
  for (let i = 0, at = 0; i < count; i += 1, at += 3) {
    positions[at] = xs[i];
    positions[at + 1] = ys[i];
    positions[at + 2] = zs[i];
  }
  const transformer = usableTransformer(options.transformer, finite, options.channel);
  const heights = transformer === "AxisColor" ? heightsOf(positions, options) : null;
  const tints = cloudColours(transformer, finite, { ...options, heights });
  return { count, columns: finite, positions, tints, transformer, hasAlpha: finite.has("rgba") && transformer === "RGB8" };
}

// Returns the coordinates along an axis of the fixed frame or of the cloud's frame.
function heightsOf(positions, { axis, isFixed, pose }) {
  const number = { X: 0, Y: 1, Z: 2 }[axis] ?? 2;
  const out = new Float32Array(positions.length / 3);
  if (!isFixed) {
    for (let i = 0; i < out.length; i += 1) out[i] = positions[i * 3 + number];
    return out;
  }
  const origin = pose[number];
  const [x, y, z] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((unit) => composed(pose, [...unit, 0, 0, 0, 1])[number] - origin);
  for (let i = 0, at = 0; i < out.length; i += 1, at += 3)
    out[i] = x * positions[at] + y * positions[at + 1] + z * positions[at + 2] + origin;
  return out;
}
