// The shapes that rviz gives to controls that have none: arrows, discs, and the button of a menu.

const [MENU, MOVE_AXIS, MOVE_PLANE, ROTATE_AXIS, MOVE_ROTATE] = [1, 3, 4, 5, 6];
const [ARROW, TEXT, TRIANGLE_LIST] = [0, 9, 11];
const STEPS = 36;
const DARK = 0.6;
const NONE = { x: 0, y: 0, z: 0 };
const UPRIGHT = { x: 0, y: 0, z: 0, w: 1 };

// Returns the markers of a control: its own, or those for its mode. `alpha` applies to default shapes.
export function markersOf(control, scale, alpha) {
  if (control.markers.length) return control.markers;
  const orientation = unit(control.orientation);
  const color = { ...colourOf(orientation), a: alpha };
  const shape = (more) => ({ header: { frame_id: "", stamp: 0n }, ns: "", id: 0, action: 0, pose: { position: NONE, orientation },
    scale: { x: 1, y: 1, z: 1 }, color, points: [], colors: [], text: "", ...more });
  const kind = control.interaction_mode;
  if (kind === MOVE_AXIS) {
    const size = { x: 0.15 * scale, y: 0.25 * scale, z: 0.2 * scale };
    const at = (x) => ({ x: x * scale, y: 0, z: 0 });
    return [1, -1].map((sign) => shape({ type: ARROW, scale: size, points: [at(0.5 * sign), at(0.9 * sign)] }));
  }
  if ([MOVE_PLANE, ROTATE_AXIS, MOVE_ROTATE].includes(kind)) {
    return [shape({ type: TRIANGLE_LIST, scale: { x: scale, y: scale, z: scale }, ...disc(kind, color) })];
  }
  if (kind === MENU) return [shape({ type: TEXT, scale: { x: 0, y: 0, z: 0.15 * scale }, pose: { position: { x: 0, y: 0, z: 1.2 * scale },
    orientation: UPRIGHT }, color: { r: 1, g: 1, b: 1, a: 1 }, text: control.description || "Menu" })];
  return [];
}

// Returns the marker of an interactive marker's description.
export const titleOf = (text, scale) =>
  ({ header: { frame_id: "", stamp: 0n }, type: TEXT, pose: { position: { x: 0, y: 0, z: 1.4 * scale }, orientation: UPRIGHT },
    scale: { x: 0, y: 0, z: 0.15 * scale }, color: { r: 1, g: 1, b: 1, a: 1 }, points: [], colors: [], text });

// Returns the normalized quaternion; the identity if its norm is 0 or not finite.
export function unit({ x, y, z, w }) {
  const norm = Math.hypot(x, y, z, w);
  return norm > 0 && Number.isFinite(norm) ? { x: x / norm, y: y / norm, z: z / norm, w: w / norm } : UPRIGHT;
}

// The colour of a control shows the direction of its x axis.
function colourOf({ x, y, z, w }) {
  const axis = [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)].map(Math.abs);
  const most = Math.max(...axis);
  const [r, g, b] = axis.map((value) => value / most);
  return { r, g, b };
}

// A ring in the plane of y and z. Its pattern shows its effect: plain rings move, segments turn, teeth do both.
function disc(kind, color) {
  const at = (radius, step) => {
    const angle = (step * 2 * Math.PI) / STEPS;
    return { x: 0, y: radius * Math.cos(angle), z: radius * Math.sin(angle) };
  };
  const inner = (step) => at(0.5, step);
  const outer = (step) => at(0.65, step);
  const points = [];
  const colors = [];
  const tint = (shade, a) => colors.push({ r: color.r * shade, g: color.g * shade, b: color.b * shade, a });
  for (let step = 0; step < STEPS; step += 1) {
    if (kind !== MOVE_ROTATE) {
      points.push(inner(step), outer(step + 1), inner(step + 1), inner(step + 1), outer(step + 1), outer(step + 2));
      const shade = step % 2 ? 1 : DARK;
      if (kind === ROTATE_AXIS) [shade, shade].forEach((each) => tint(each, 1));
    } else if (step % 2) {
      points.push(inner(step - 1), outer(step), inner(step + 1), outer(step), outer(step + 2), inner(step + 1));
      tint(DARK, 1);
      tint(1, 0.5);
    }
  }
  return { points, colors };
}
