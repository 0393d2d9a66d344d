// Checks of markers, with rviz's errors and warnings.

const [ARROW, LINE_STRIP, LINE_LIST, CUBES, SPHERES, POINTS, TEXT, MESH, TRIANGLES] = [0, 4, 5, 6, 7, 8, 9, 10, 11];
const LISTS = [LINE_STRIP, LINE_LIST, CUBES, SPHERES, POINTS, TRIANGLES];

const isFinite = (...parts) => parts.every((part) => Object.values(part).every(Number.isFinite));

// The points that must be finite. Of lists, the finite ones are drawn.
const ends = (type, points) => (type === ARROW ? points : []);

// Returns why a marker cannot be drawn, or an empty text.
export function problemOf({ pose, scale, color, points, colors, type, text, mesh_resource: mesh }) {
  const { position, orientation } = pose;
  const sum = position.x + position.y + position.z + orientation.x + orientation.y + orientation.z + orientation.w + scale.x + scale.y +
    scale.z + color.r + color.g + color.b + color.a; // finite only if all are
  if (type > ARROW && type < LINE_STRIP && Number.isFinite(sum) && !points.length && !colors.length) return "";
  const parts = { Position: [position], Orientation: [orientation], Scale: [scale], Color: [color], Points: ends(type, points) };
  const invalid = Object.keys(parts).filter((name) => !isFinite(...parts[name]));
  if (invalid.length) return invalid.map((name) => `${name} contains invalid floating point values (nans or infs)`).join("\n");
  if (LISTS.includes(type)) return problemOfList(type, points.length, colors.length);
  if (type === ARROW && points.length !== 0 && points.length !== 2) return "Number of points for an ARROW marker should be either 0 or 2.";
  if (type === TEXT && !text.trim()) return "Text is empty or only consists of whitespace.";
  return type === MESH && !mesh ? "Empty mesh_resource path." : "";
}

function problemOfList(type, points, colors) {
  if (!points) return "Points should not be empty for specified marker type.";
  if (type === TRIANGLES && points % 3) return "Number of points should be a multiple of 3 for TRIANGLE_LIST marker.";
  if (type === LINE_LIST && points % 2) return "Number of points should be a multiple of 2 for LINE_LIST marker.";
  if (type === LINE_STRIP && points < 2) return "At least two points are required for a LINE_STRIP marker.";
  const fits = !colors || colors === points || (type === TRIANGLES && colors === points / 3);
  return fits ? "" : "Number of colors doesn't match number of points.";
}

// Returns rviz's warning on a marker, or an empty text.
export function warningOf({ pose: { orientation: q }, scale, color, colors, type }) {
  const found = [];
  const norm = q.x ** 2 + q.y ** 2 + q.z ** 2 + q.w ** 2;
  if (norm === 0) found.push("Uninitialized quaternion, assuming identity.");
  else if (Math.abs(norm - 1) > 0.01) found.push("Unnormalized quaternion in marker message.");
  found.push(...sizeWarnings(type, scale));
  if (color.a === 0 && !colors.length && type !== MESH) found.push("Marker is fully transparent (color.a is 0.0).");
  return found.join("\n");
}

function sizeWarnings(type, scale) {
  if (type === LINE_STRIP || type === LINE_LIST) return scale.x === 0 ? ["Width LINE_LIST or LINE_STRIP is 0.0 (scale.x)."] : [];
  if (type === POINTS) return scale.x === 0 || scale.y === 0 ? ["Width and/or height of POINTS is 0.0 (scale.x, scale.y)."] : [];
  if (type === TEXT) return scale.z === 0 ? ["Text height of TEXT_VIEW_FACING is 0.0 (scale.z)."] : [];
  if (type === ARROW) return [];
  return scale.x === 0 || scale.y === 0 || scale.z === 0 ? ["Scale contains 0.0 in x, y or z."] : [];
}
