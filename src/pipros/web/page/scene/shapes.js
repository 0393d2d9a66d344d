// Solid shapes and lines as rviz draws them: lit by a light in the direction of view, with alpha.

import * as THREE from "three";

export const OPAQUE = 0.9998;

/** @type {(rgb: number[]) => any} */
export const colourOf = ([r, g, b]) => new THREE.Color(r / 255, g / 255, b / 255);

// Material of solid shapes. `rgb` has channels from 0 to 255.
export function lit(rgb, alpha = 1, options = {}) {
  return new THREE.MeshLambertMaterial({ color: colourOf(rgb), ...blended(alpha), ...options });
}

export function unlit(rgb, alpha = 1, options = {}) {
  return new THREE.MeshBasicMaterial({ color: colourOf(rgb), ...blended(alpha), ...options });
}

export function blended(alpha) {
  const transparent = alpha < OPAQUE;
  return { transparent, opacity: transparent ? alpha : 1, depthWrite: !transparent };
}

// Shared geometries of size 1; cylinders and cones along z.
export const BOX = new THREE.BoxGeometry(1, 1, 1);
export const SPHERE = new THREE.SphereGeometry(0.5, 32, 16);
export const CYLINDER = new THREE.CylinderGeometry(0.5, 0.5, 1, 32).rotateX(Math.PI / 2);
export const CONE = new THREE.ConeGeometry(0.5, 1, 32).rotateX(Math.PI / 2);
const ROD = CYLINDER.clone().translate(0, 0, 0.5).rotateY(Math.PI / 2); // from the origin along +x
const TIP = CONE.clone().translate(0, 0, 0.5).rotateY(Math.PI / 2);
const SHARED = new Set([BOX, SPHERE, CYLINDER, CONE, ROD, TIP]);

// An arrow along +x, from the origin. The head's colour may differ.
export function arrow(shaftLength, shaftDiameter, headLength, headDiameter, material, headMaterial = material) {
  const group = new THREE.Group();
  const shaft = new THREE.Mesh(ROD, material);
  shaft.scale.set(shaftLength || 1e-6, shaftDiameter || 1e-6, shaftDiameter || 1e-6);
  const head = new THREE.Mesh(TIP, headMaterial);
  head.scale.set(headLength || 1e-6, headDiameter || 1e-6, headDiameter || 1e-6);
  head.position.x = shaftLength;
  group.add(shaft, head);
  return group;
}

// Axes from the origin: x red, y green, z blue. `diameter` is what rviz calls radius.
export function axes(length, diameter, alpha = 1) {
  const group = new THREE.Group();
  [[255, 0, 0], [0, 255, 0], [0, 0, 255]].forEach((colour, index) => {
    const rod = new THREE.Mesh(ROD, lit(colour, alpha));
    rod.scale.set(length || 1e-6, diameter || 1e-6, diameter || 1e-6);
    if (index === 1) rod.rotation.z = Math.PI / 2;
    if (index === 2) rod.rotation.y = -Math.PI / 2;
    group.add(rod);
  });
  return group;
}

// Lines one pixel wide. `points` has x, y, z of each point; with `isStrip` they are connected.
export function thinLines(points, rgb, alpha = 1, { isStrip = false, colours = null } = {}) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(points), 3));
  if (colours) geometry.setAttribute("color", new THREE.BufferAttribute(Float32Array.from(colours), 4));
  const color = colours ? 0xffffff : colourOf(rgb);
  const material = new THREE.LineBasicMaterial({ color, vertexColors: Boolean(colours), ...blended(alpha) });
  if (colours) material.transparent = true;
  const lines = isStrip ? new THREE.Line(geometry, material) : new THREE.LineSegments(geometry, material);
  lines.frustumCulled = false;
  return lines;
}

const WIDE_VERTEX = `
attribute vec3 from;
attribute vec3 to;
attribute vec4 tintFrom;
attribute vec4 tintTo;
uniform float width;
varying vec4 tint;
void main() {
  vec3 a = (modelViewMatrix * vec4(from, 1.0)).xyz;
  vec3 b = (modelViewMatrix * vec4(to, 1.0)).xyz;
  vec3 here = mix(a, b, position.x);
  vec3 along = b - a;
  vec3 view = isOrthographic ? vec3(0.0, 0.0, -1.0) : here;
  vec3 side = cross(along, view);
  float size = length(side);
  side = size > 0.0 ? side / size : vec3(0.0);
  tint = mix(tintFrom, tintTo, position.x);
  gl_Position = projectionMatrix * vec4(here + side * position.y * width, 1.0);
}`;

// The colour of a number, by which Selection recognises what is drawn at a pixel. If the uniform `number` is not 0, its
// colour replaces the object's: a positive number is the first point's; a negative number stands for the whole object.
export const NUMBER_TINT = "vec4 tintOf(float value) { return vec4(mod(floor(value / vec3(65536.0, 256.0, 1.0)), 256.0) / 255.0, 1.0); }";

const TINT_FRAGMENT = `
uniform float number;
varying vec4 tint;
${NUMBER_TINT}
void main() { gl_FragColor = number != 0.0 ? tintOf(abs(number)) : tint; }`;

// Lines with a width in metres that face the camera. `points` has x, y, z of each point, two per line; `colours` RGBA
// of each (0 to 1), or of all.
export function wideLines(points, width, colours, isTransparent = false) {
  const geometry = new THREE.InstancedBufferGeometry();
  const corners = new Float32Array([0, -0.5, 0, 1, -0.5, 0, 1, 0.5, 0, 0, 0.5, 0]);
  geometry.setAttribute("position", new THREE.BufferAttribute(corners, 3));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  const count = Math.floor(points.length / 6);
  const ends = new THREE.InstancedInterleavedBuffer(Float32Array.from(points.slice(0, count * 6)), 6, 1);
  geometry.setAttribute("from", new THREE.InterleavedBufferAttribute(ends, 3, 0));
  geometry.setAttribute("to", new THREE.InterleavedBufferAttribute(ends, 3, 3));
  const isEach = count > 0 && colours.length >= count * 8;
  const all = Float32Array.from({ length: count * 8 }, (_, i) => colours[isEach ? i : i % 4]);
  const tints = new THREE.InstancedInterleavedBuffer(all, 8, 1);
  geometry.setAttribute("tintFrom", new THREE.InterleavedBufferAttribute(tints, 4, 0));
  geometry.setAttribute("tintTo", new THREE.InterleavedBufferAttribute(tints, 4, 4));
  geometry.instanceCount = count;
  const material = new THREE.ShaderMaterial({
    vertexShader: WIDE_VERTEX,
    fragmentShader: TINT_FRAGMENT,
    uniforms: { width: { value: width }, number: { value: 0 } },
    side: THREE.DoubleSide,
    transparent: isTransparent,
    depthWrite: !isTransparent,
  });
  const mesh = new THREE.Mesh(geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}

// Returns x, y, z of both ends of each line of a strip.
export function segments(strip) {
  const out = [];
  for (let i = 0; i + 5 < strip.length; i += 3) out.push(...strip.slice(i, i + 6));
  return out;
}

// A text that faces the camera; `height` is the height of a line in metres. `centre` is [0.5, 1] for a text below its position.
export function textSprite(text, height, rgb = [255, 255, 255], alpha = 1, centre = [0.5, 0.5]) {
  const lines = text.split("\n").slice(0, 100).map((line) => line.slice(0, 300));
  const size = 48;
  const canvas = document.createElement("canvas");
  const drawing = canvas.getContext("2d");
  const font = `${size}px "Liberation Sans", Arimo, Arial, sans-serif`;
  drawing.font = font;
  const widest = Math.max(...lines.map((line) => drawing.measureText(line).width));
  canvas.width = Math.max(2, Math.min(4096, Math.ceil(widest) + 4));
  canvas.height = Math.min(4096, lines.length * size);
  drawing.font = font;
  drawing.fillStyle = "white";
  drawing.textAlign = "center";
  drawing.textBaseline = "middle";
  lines.forEach((line, index) => drawing.fillText(line, canvas.width / 2, (index + 0.5) * size));
  const texture = new THREE.CanvasTexture(canvas);
  const looks = { map: texture, color: colourOf(rgb), opacity: alpha, transparent: true, depthWrite: false };
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial(looks));
  sprite.center.set(centre[0], centre[1]);
  sprite.scale.set((height * canvas.width) / size, (height * canvas.height) / size, 1);
  return sprite;
}

// Removes all children, and frees their memory on the graphics card.
export function clear(group) {
  for (const child of [...group.children]) {
    group.remove(child);
    dispose(child);
  }
}

export function dispose(object) {
  object.traverse((each) => {
    if (each.geometry && !SHARED.has(each.geometry) && !each.geometry.userData.isShared && !each.isSprite) each.geometry.dispose();
    for (const material of [each.material ?? []].flat()) {
      if (material.map && !material.map.userData.isShared) material.map.dispose();
      material.dispose();
    }
    if (each.isInstancedMesh) each.dispose();
  });
}

// Places an object at a pose of seven numbers.
export function place(object, pose) {
  object.position.set(pose[0], pose[1], pose[2]);
  object.quaternion.set(pose[3], pose[4], pose[5], pose[6]).normalize();
}
