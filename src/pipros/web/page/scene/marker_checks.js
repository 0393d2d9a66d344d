// What is wrong with a marker: rviz's errors and warnings. Pure.

import { isFinitePose, poseOf } from "./pose.js";

const [ARROW, LINE_STRIP, LINE_LIST, POINTS, TEXT, MESH] = [0, 4, 5, 8, 9, 10];

// Returns why a marker cannot be drawn, or an empty text.
export function problemOf({ pose, scale, color, points: places, colors, type }) {
  const numbers = [scale.x, scale.y, scale.z, color.r, color.g, color.b, color.a];
  const isValid = numbers.every(Number.isFinite) && isFinitePose(poseOf(pose)) && places.every(({ x, y, z }) => Number.isFinite(x + y + z));
  if (!isValid || !colors.every(({ r, g, b, a }) => Number.isFinite(r + g + b + a))) return "Contains invalid floating point values (nans or infs)";
  if (type === LINE_LIST && places.length % 2) return "Number of points is not even.";
  return "";
}

// Returns rviz's warning on a marker, or an empty text.
export function warningOf({ pose: { orientation: q }, scale, color, colors, type, text }) {
  const found = [];
  const norm = q.x ** 2 + q.y ** 2 + q.z ** 2 + q.w ** 2;
  if (norm === 0) found.push("Uninitialized quaternion, assuming identity.");
  else if (Math.abs(norm - 1) > 0.01) found.push("Unnormalized quaternion in marker message.");
  found.push(...sizeWarnings(type, scale, text));
  if (color.a === 0 && !colors.length && type !== MESH) found.push("Marker is fully transparent (color.a is 0.0).");
  return found.join("\n");
}

function sizeWarnings(type, scale, text) {
  if (type === LINE_STRIP || type === LINE_LIST) return scale.x === 0 ? ["Width LINE_LIST or LINE_STRIP is 0.0 (scale.x)."] : [];
  if (type === TEXT) return [...(scale.z === 0 ? ["Text height of TEXT_VIEW_FACING is 0.0 (scale.z)."] : []), ...(text ? [] : ["Empty text."])];
  if (type === ARROW) return [];
  return scale.x === 0 || scale.y === 0 || (scale.z === 0 && type !== POINTS) ? ["Scale contains 0.0 in x, y or z."] : [];
}
