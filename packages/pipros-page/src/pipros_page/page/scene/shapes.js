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
// The same with fewer sides, for axes and the arrows of frames: there are many, and each triangle takes time to draw.
const THIN_ROD = new THREE.CylinderGeometry(0.5, 0.5, 1, 8).translate(0, 0.5, 0).rotateZ(-Math.PI / 2);
const THIN_TIP = new THREE.ConeGeometry(0.5, 1, 8).translate(0, 0.5, 0).rotateZ(-Math.PI / 2);
const SHARED = new Set([BOX, SPHERE, CYLINDER, CONE, ROD, TIP]);
const CROSSES = new Map(); // thickness to a geometry of three rods
const MAX_CROSSES = 100;

// Returns three rods of length 1, coloured as axes, in one geometry.
function crossOf(thickness) {
  const known = CROSSES.get(thickness);
  if (known) return known;
  if (CROSSES.size >= MAX_CROSSES) {
    for (const each of CROSSES.values()) {
      each.userData.isShared = false; // freed with the last object that uses it
      each.dispose(); // if it is still drawn, it is uploaded again
    }
    CROSSES.clear();
  }
  const rod = THIN_ROD.clone().scale(1, thickness, thickness);
  const made = joined([rod, rod.clone().rotateZ(Math.PI / 2), rod.clone().rotateY(-Math.PI / 2)]);
  made.userData.isShared = true;
  CROSSES.set(thickness, made);
  return made;
}

// Returns one geometry from several, coloured with the given colours (r, g, b of 0 to 1), because each object takes time
// to draw.
export function joined(geometries, colours = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]) {
  const made = new THREE.BufferGeometry();
  const count = geometries.reduce((sum, each) => sum + each.getAttribute("position").count, 0);
  const [position, normal, color] = [0, 1, 2].map(() => new Float32Array(3 * count));
  const corners = [];
  let first = 0;
  geometries.forEach((each, number) => {
    position.set(each.getAttribute("position").array, 3 * first);
    normal.set(each.getAttribute("normal").array, 3 * first);
    for (const corner of each.getIndex().array) corners.push(corner + first);
    const end = first + each.getAttribute("position").count;
    for (; first < end; first += 1) color.set(colours[number], 3 * first);
  });
  for (const [name, values] of Object.entries({ position, normal, color })) made.setAttribute(name, new THREE.BufferAttribute(values, 3));
  made.setIndex(corners);
  return made;
}

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

// Returns an arrow along +x as one geometry, whose shaft and head have the given colours (r, g, b of 0 to 1).
export function arrowShape(shaftLength, shaftDiameter, headLength, headDiameter, shaftColour, headColour) {
  const shaft = THIN_ROD.clone().scale(shaftLength || 1e-6, shaftDiameter || 1e-6, shaftDiameter || 1e-6);
  const head = THIN_TIP.clone().scale(headLength || 1e-6, headDiameter || 1e-6, headDiameter || 1e-6).translate(shaftLength, 0, 0);
  return joined([shaft, head], [shaftColour, headColour]);
}

// Axes from the origin: x red, y green, z blue. `diameter` is what rviz calls radius. The material's `userData.fade`
// has the part of grey in the colours (0 to 1) as its value.
export function axes(length, diameter, alpha = 1) {
  const long = length || 1e-6;
  const material = lit([255, 255, 255], alpha, { vertexColors: true });
  const fade = material.userData.fade = { value: 0 };
  material.onBeforeCompile = (shader) => {
    shader.uniforms.fade = fade;
    shader.fragmentShader = `uniform float fade;\n${shader.fragmentShader}`
      .replace("#include <color_fragment>", "diffuseColor.rgb = mix(vColor.rgb, vec3(0.7), fade);");
  };
  const rods = new THREE.Mesh(crossOf((diameter || 1e-6) / long), material);
  rods.scale.setScalar(long);
  return new THREE.Group().add(rods);
}

// Clips a line at the near plane. Chromium without a graphics card omits lines that begin behind the viewer.
const CLIPPED = `
  vec4 to = projectionMatrix * modelViewMatrix * vec4(other, 1.0);
  float inside = gl_Position.z + gl_Position.w, insideTo = to.z + to.w;
  if (inside < 0.0 && insideTo > 0.0) gl_Position = mix(gl_Position, to, inside / (inside - insideTo));`;

// Lines one pixel wide. `points` has x, y, z of each point; with `isStrip` they are connected.
export function thinLines(points, rgb, alpha = 1, { isStrip = false, colours = null } = {}) {
  const geometry = new THREE.BufferGeometry();
  const ends = Float32Array.from(isStrip ? segments(points) : points);
  geometry.setAttribute("position", new THREE.BufferAttribute(ends, 3));
  geometry.setAttribute("other", new THREE.BufferAttribute(ends.map((_, i) => ends[i % 6 < 3 ? i + 3 : i - 3]), 3));
  if (colours) geometry.setAttribute("color", new THREE.BufferAttribute(Float32Array.from(colours), 4));
  const color = colours ? 0xffffff : colourOf(rgb);
  const material = new THREE.LineBasicMaterial({ color, vertexColors: Boolean(colours), ...blended(alpha) });
  if (colours) material.transparent = true;
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = `attribute vec3 other;\n${shader.vertexShader.replace("#include <project_vertex>", `$&${CLIPPED}`)}`;
  };
  const lines = new THREE.LineSegments(geometry, material);
  lines.frustumCulled = false;
  return lines;
}

// Places and colours in a texture, from which a shader reads them by number. A geometry with instances would take less
// memory; but in software rendering, each instance takes as long as 200 triangles.
const READ_PLACE = `
uniform highp usampler2D places;
vec3 placeOf(int number, out vec4 colour) {
  int across = textureSize(places, 0).x;
  uvec4 words = texelFetch(places, ivec2(number % across, number / across), 0);
  colour = vec4((uvec4(words.w) >> uvec4(0u, 8u, 16u, 24u)) & 255u) / 255.0;
  return uintBitsToFloat(words.xyz);
}`;
const ACROSS = 2048;

// Returns an object whose vertex shader gets `verticesEach` vertices for each place.
//   positions: x, y, z of each place (Float32Array)
//   tints: r, g, b, a of each place (Uint8Array)
//   options: those of the material, and `half`, half the size of what is drawn at each place (for selections)
export function drawnFromTexture(positions, tints, verticesEach, options) {
  const count = Math.floor(positions.length / 3);
  const across = Math.max(1, Math.min(count, ACROSS));
  const high = Math.max(1, Math.ceil(count / across));
  const words = new Uint32Array(across * high * 4);
  const [places, colours] = [positions, tints].map((each) => new Uint32Array(each.slice().buffer));
  for (let i = 0; i < count; i += 1) {
    words.set(places.subarray(i * 3, i * 3 + 3), i * 4);
    words[i * 4 + 3] = colours[i];
  }
  const texture = new THREE.DataTexture(words, across, high, THREE.RGBAIntegerFormat, THREE.UnsignedIntType);
  texture.internalFormat = "RGBA32UI";
  texture.needsUpdate = true;
  const geometry = new THREE.BufferGeometry();
  geometry.setDrawRange(0, count * verticesEach);
  geometry.userData.places = positions;
  const { vertexShader, uniforms, half = new THREE.Vector3(), ...more } = options;
  geometry.computeBoundingBox = () => {
    geometry.boundingBox = new THREE.Box3().setFromArray(positions).expandByVector(half);
  };
  const material = new THREE.ShaderMaterial({
    vertexShader: READ_PLACE + vertexShader,
    uniforms: { places: { value: texture }, number: { value: 0 }, ...uniforms },
    side: THREE.DoubleSide,
    ...more,
  });
  const mesh = new THREE.Mesh(geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}

const WIDE_VERTEX = `
uniform float width;
#ifndef ONE_COLOUR
varying vec4 tint;
#endif
void main() {
  int line = gl_VertexID / 6;
  int corner = gl_VertexID % 6;
  float end = corner == 1 || corner >= 4 ? 1.0 : 0.0;
  float edge = corner == 2 || corner == 3 || corner == 5 ? 0.5 : -0.5;
  vec4 tintFrom, tintTo;
  vec3 a = (modelViewMatrix * vec4(placeOf(2 * line, tintFrom), 1.0)).xyz;
  vec3 b = (modelViewMatrix * vec4(placeOf(2 * line + 1, tintTo), 1.0)).xyz;
  vec3 here = mix(a, b, end);
  vec3 along = b - a;
  vec3 view = isOrthographic ? vec3(0.0, 0.0, -1.0) : here;
  vec3 side = cross(along, view);
  float size = length(side);
  side = size > 0.0 ? side / size : vec3(0.0);
#ifndef ONE_COLOUR
  tint = mix(tintFrom, tintTo, end);
#endif
  gl_Position = projectionMatrix * vec4(here + side * edge * width, 1.0);
}`;

// The colour of a number, by which Selection recognises what is drawn at a pixel. If the uniform `number` is not 0, its
// colour replaces the object's: a positive number is the first point's; a negative number stands for the whole object.
export const NUMBER_TINT = "vec4 tintOf(float value) { return vec4(mod(floor(value / vec3(65536.0, 256.0, 1.0)), 256.0) / 255.0, 1.0); }";

// For lines of one colour, `tint` is a uniform: in software, interpolating it takes a third of the drawing time.
const TINT_FRAGMENT = `
uniform float number;
#ifdef ONE_COLOUR
uniform vec4 tint;
#else
varying vec4 tint;
#endif
${NUMBER_TINT}
void main() { gl_FragColor = number != 0.0 ? tintOf(abs(number)) : tint; }`;

// Lines with a width in metres that face the camera. `points` has x, y, z of each point, two per line; `colours` RGBA
// of each (0 to 1), or of all.
export function wideLines(points, width, colours, isTransparent = false) {
  const count = 2 * Math.floor(points.length / 6);
  const isEach = count > 0 && colours.length >= count * 4;
  const tints = Uint8ClampedArray.from({ length: count * 4 }, (_, i) => 255 * colours[isEach ? i : i % 4]);
  const places = Float32Array.from(points.slice(0, count * 3));
  return drawnFromTexture(places, tints, 3, {
    vertexShader: WIDE_VERTEX,
    fragmentShader: TINT_FRAGMENT,
    uniforms: { width: { value: width }, tint: { value: new THREE.Vector4(...colours.slice(0, 4)) } },
    defines: isEach ? {} : { ONE_COLOUR: "" },
    transparent: isTransparent,
    depthWrite: !isTransparent,
  });
}

// Returns x, y, z of both ends of each line of a strip.
export function segments(strip) {
  const out = [];
  for (let i = 0; i + 5 < strip.length; i += 3) out.push(...strip.slice(i, i + 6));
  return out;
}

const MOST_TEXT_PX = 4096; // width and height of the largest texture that every graphics card has

// A text that faces the camera; `height` is the height of a line in metres. `centre` is [0.5, 1] for a text below its position.
export function textSprite(text, height, rgb = [255, 255, 255], alpha = 1, centre = [0.5, 0.5]) {
  const lines = text.split("\n").slice(0, 100).map((line) => line.slice(0, 300));
  const size = 48;
  const canvas = document.createElement("canvas");
  const drawing = canvas.getContext("2d");
  const font = `${size}px "Liberation Sans", Arimo, Arial, sans-serif`;
  const style = { font, fillStyle: "white", textAlign: "center", textBaseline: "middle" };
  Object.assign(drawing, style);
  const drawn = lines.map((line) => drawing.measureText(line));
  const most = (extent) => Math.ceil(Math.max(...drawn.map(extent)));
  const half = 2 + most((line) => Math.max(line.width / 2, line.actualBoundingBoxLeft, line.actualBoundingBoxRight));
  // Marks such as the dot of "İ" may be beyond the lines' heights: above the first line, and below the last one.
  const above = Math.max(0, 1 + most((line, index) => line.actualBoundingBoxAscent - (index + 0.5) * size));
  const below = Math.max(0, 1 + most((line, index) => line.actualBoundingBoxDescent - (lines.length - index - 0.5) * size));
  const [width, whole] = [2 * half, above + lines.length * size + below];
  canvas.width = Math.min(MOST_TEXT_PX, width); // a larger text is drawn smaller, and stretched
  canvas.height = Math.min(MOST_TEXT_PX, whole);
  Object.assign(drawing, style);
  drawing.scale(canvas.width / width, canvas.height / whole);
  lines.forEach((line, index) => drawing.fillText(line, half, above + (index + 0.5) * size));
  const texture = new THREE.CanvasTexture(canvas);
  const looks = { map: texture, color: colourOf(rgb), opacity: alpha, transparent: true, depthWrite: false };
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial(looks));
  sprite.center.set(centre[0], (below + centre[1] * lines.length * size) / whole);
  sprite.scale.set((height * width) / size, (height * whole) / size, 1);
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
      material.uniforms?.places?.value.dispose();
      material.dispose();
    }
  });
}

// Places an object at a pose of seven numbers.
export function place(object, pose) {
  object.position.set(pose[0], pose[1], pose[2]);
  object.quaternion.set(pose[3], pose[4], pose[5], pose[6]).normalize();
}
