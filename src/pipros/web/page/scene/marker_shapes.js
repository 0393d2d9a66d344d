// The shapes of markers, except for those with meshes.

import * as THREE from "three";
import { points } from "./points.js";
import { BOX, CYLINDER, SPHERE, arrow, lit, segments, textSprite, unlit, wideLines } from "./shapes.js";

const solids = [BOX, SPHERE, CYLINDER].map((shape) => (marker, rgb) => solid(shape, marker, rgb));
const TYPES = [arrowOf, ...solids, strip, list, cubes, spheres, squares, label, null, triangles];

// Returns the object of a marker; null for an unknown type.
export function drawnMarker(marker) {
  return TYPES[marker.type]?.(marker, rgbOf(marker)) ?? null;
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
  const head = Math.min(length, scale.z || 0.23 * length);
  const shape = arrow(length - head, scale.x, head, scale.y, material);
  shape.position.copy(from);
  if (length) shape.quaternion.setFromUnitVectors(new THREE.Vector3(1, 0, 0), along.normalize());
  group.add(shape);
  return group;
}

export const rgbOf = ({ color }) => [color.r, color.g, color.b].map((part) => part * 255);

function solid(geometry, { scale, color }, rgb) {
  const mesh = new THREE.Mesh(geometry, lit(rgb, color.a));
  mesh.scale.set(scale.x || 1e-9, scale.y || 1e-9, scale.z || 1e-9);
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
  return wideLines(segments(coordinates(marker.points)), marker.scale.x, isEach ? doubled : tints, hasAlpha(isEach, tints));
}

function list(marker) {
  const { isEach, tints } = tintsOf(marker);
  return wideLines(coordinates(marker.points), marker.scale.x, tints, hasAlpha(isEach, tints));
}

const hasAlpha = (isEach, tints) => (isEach ? tints.some((value, i) => i % 4 === 3 && value < 0.9998) : tints[3] < 0.9998);

function many(style, marker, size) {
  const { isEach, tints } = tintsOf(marker);
  const count = marker.points.length;
  const byte = (value) => Math.min(255, Math.max(0, Math.round(value * 255)));
  const bytes = Uint8Array.from({ length: count * 4 }, (_, i) => byte(tints[isEach ? i : i % 4]));
  return points(style, Float32Array.from(coordinates(marker.points)), bytes, size, 1, hasAlpha(isEach, tints));
}

function cubes(marker) {
  return many("Boxes", marker, [marker.scale.x, marker.scale.y, marker.scale.z]);
}

function spheres(marker) {
  return many("Spheres", marker, marker.scale.x);
}

function squares(marker) {
  return many("Squares", marker, marker.scale.x);
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
  const isColoured = perTriangle || (colors.length > 0 && colors.length >= count);
  if (isColoured) {
    const tints = Float32Array.from({ length: count * 4 }, (_, i) => {
      const { r, g, b, a } = colors[perTriangle ? Math.floor(i / 12) : i >> 2];
      return [r, g, b, a][i % 4];
    });
    geometry.setAttribute("color", new THREE.BufferAttribute(tints, 4));
  }
  const group = new THREE.Group();
  const add = (material) => {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.scale.set(scale.x || 1e-9, scale.y || 1e-9, scale.z || 1e-9);
    group.add(mesh);
  };
  // The light reaches the front only; the back of triangles without colours is black.
  if (isColoured) add(unlit([255, 255, 255], color.a, { side: THREE.DoubleSide, vertexColors: true }));
  else {
    add(lit(rgb, color.a));
    add(unlit([0, 0, 0], color.a, { side: THREE.BackSide }));
  }
  return group;
}
