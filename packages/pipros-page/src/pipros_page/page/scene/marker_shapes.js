// The shapes of markers, except for those with meshes.

import * as THREE from "three";
import { SMALLEST, sizesOf } from "./marker_parts.js";
import { points } from "./points.js";
import { BOX, CYLINDER, OPAQUE, SPHERE, arrow, blended, lit, segments, textSprite, unlit, wideLines } from "./shapes.js";

const solids = [BOX, SPHERE, CYLINDER].map((shape) => (marker, rgb) => solid(shape, marker, rgb));
// Lists of squares and discs whose width or height is 0, or one of which is negative, are invisible in rviz.
const flat = (style) => (marker) => {
  const { x, y } = marker.scale;
  return many(style, x * y > 0 ? marker : { ...marker, points: [] }, Math.abs(x));
};
const TYPES = [arrowOf, ...solids, strip, list, cubes, flat("Spheres"), flat("Squares"), label, null, triangles];

const PARTS = { 5: 2, 11: 3 }; // points of each line and triangle, of the types LINE_LIST and TRIANGLE_LIST

// Returns the object of a marker; null for an unknown type.
export function drawnMarker(marker) {
  return TYPES[marker.type]?.(finite(marker), rgbOf(marker)) ?? null;
}

// Returns a marker without the points, lines and triangles whose coordinates are not finite.
function finite(marker) {
  const { points: places, colors } = marker;
  const isGood = places.map(({ x, y, z }) => Number.isFinite(x + y + z));
  if (isGood.every(Boolean)) return marker;
  const each = PARTS[marker.type] ?? 1;
  const isKept = (_, i) => isGood.slice(i - (i % each), i - (i % each) + each).every(Boolean);
  const perTriangle = each === 3 && colors.length === places.length / 3;
  return { ...marker, points: places.filter(isKept), colors: colors.filter((_, i) => isKept(_, perTriangle ? 3 * i : i)) };
}

function arrowOf({ scale, color, points: places }, rgb) {
  const material = lit(rgb, color.a);
  const group = new THREE.Group();
  if (places.length < 2) {
    group.add(arrow(0.77 * scale.x, scale.y, 0.23 * scale.x, 2 * scale.y, material));
    group.scale.z = scale.y ? scale.z / scale.y : 1;
    const turned = new THREE.Group();
    turned.add(group);
    return turned;
  }
  const [from, to] = places.map(({ x, y, z }) => new THREE.Vector3(x, y, z));
  const along = to.clone().sub(from);
  const length = along.length();
  const head = Math.max(0, Math.min(length, scale.z || 0.23 * length));
  const shape = arrow(length - head, scale.x, head, scale.y, material);
  shape.position.copy(from);
  if (length) shape.quaternion.setFromUnitVectors(new THREE.Vector3(1, 0, 0), along.normalize());
  group.add(shape);
  return group;
}

export const rgbOf = ({ color }) => [color.r, color.g, color.b].map((part) => part * 255);

function solid(geometry, { scale, color }, rgb) {
  const mesh = new THREE.Mesh(geometry, lit(rgb, color.a));
  mesh.scale.set(...sizesOf(scale));
  const group = new THREE.Group();
  group.add(mesh);
  return group;
}

const coordinates = (places) => places.flatMap(({ x, y, z }) => [x, y, z]);

// Returns RGBA (0 to 1) of each point: the points' own colours, if there is one for each.
function tintsOf({ color, colors, points: places }) {
  const isEach = colors.length > 0 && colors.length >= places.length;
  const own = isEach ? colors.slice(0, places.length) : [color];
  return { isEach, tints: own.flatMap(({ r, g, b, a }) => [r, g, b, a]) };
}

function strip(marker) {
  const { isEach, tints } = tintsOf(marker);
  const doubled = [];
  if (isEach) for (let i = 0; i + 8 <= tints.length; i += 4) doubled.push(...tints.slice(i, i + 8));
  return lines(marker, segments(coordinates(marker.points)), isEach ? doubled : tints);
}

function list(marker) {
  return lines(marker, coordinates(marker.points), tintsOf(marker).tints);
}

// In rviz, only the marker's own alpha decides whether lines are blended; then, those of the points count. Lines of negative
// width are invisible.
function lines({ color, scale }, ends, tints) {
  const isBlended = color.a < OPAQUE;
  const shown = isBlended ? tints : tints.map((value, i) => (i % 4 === 3 ? 1 : value));
  return wideLines(scale.x > 0 ? ends : [], scale.x, shown, isBlended);
}

function many(style, marker, size) {
  const { isEach, tints } = tintsOf(marker);
  if (!isEach) tints[3] = Math.max(0, tints[3]) ** 2; // rviz multiplies the marker's alpha with that of its points, which is the same
  const isBlended = tints.some((value, i) => i % 4 === 3 && value < OPAQUE);
  const count = marker.points.length;
  const byte = (value) => Math.min(255, Math.max(0, Math.round(value * 255)));
  const bytes = Uint8Array.from({ length: count * 4 }, (_, i) => byte(tints[isEach ? i : i % 4]));
  const made = points(style, Float32Array.from(coordinates(marker.points)), bytes, size, 1, isBlended);
  if (!isBlended) return made;
  // rviz draws these lists twice: as parts of the marker, and as objects of the scene
  const again = made.clone();
  again.onBeforeRender = made.onBeforeRender;
  return new THREE.Group().add(made, again);
}

function cubes(marker) {
  return many("Boxes", marker, [marker.scale.x, marker.scale.y, marker.scale.z]);
}

function label({ text, scale, color }, rgb) {
  const group = new THREE.Group();
  if (text.trim()) group.add(textSprite(text, scale.z, rgb, color.a));
  return group;
}

function triangles(marker, rgb) {
  const { points: places, colors, color, scale } = marker;
  const count = Math.floor(places.length / 3) * 3;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(coordinates(places.slice(0, count))), 3));
  geometry.computeVertexNormals();
  const perTriangle = colors.length > 0 && colors.length === count / 3;
  let isBlended = color.a < OPAQUE;
  const isColoured = perTriangle || (colors.length > 0 && colors.length >= count);
  if (isColoured) {
    const tints = Float32Array.from({ length: count * 4 }, (_, i) => {
      const { r, g, b, a } = colors[perTriangle ? Math.floor(i / 12) : i >> 2];
      return Math.max(0, Math.min(1, [r, g, b, perTriangle ? a * color.a : a][i % 4])) || 0; // not NaN or infinite
    });
    geometry.setAttribute("color", new THREE.BufferAttribute(tints, 4));
    // In rviz, the alphas of corners replace the marker's; those of triangles count only if the marker is see-through, too.
    isBlended ||= !perTriangle && tints.some((value, i) => i % 4 === 3 && value < OPAQUE);
  }
  const group = new THREE.Group();
  const add = (material) => {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.scale.set(scale.x || SMALLEST, scale.y || SMALLEST, scale.z || SMALLEST);
    group.add(mesh);
  };
  // The light reaches the front only; the back of triangles without colours is black.
  if (isColoured) add(unlit([255, 255, 255], 1, { side: THREE.DoubleSide, vertexColors: true, ...blended(isBlended ? 0 : 1), opacity: 1 }));
  else {
    add(lit(rgb, color.a));
    add(unlit([0, 0, 0], color.a, { side: THREE.BackSide }));
  }
  return group;
}
