// Many points in one object: discs, squares, spheres and boxes with a colour each.

import * as THREE from "three";
import { NUMBER_TINT, OPAQUE, drawnFromTexture } from "./shapes.js";

const STYLES = { Points: 0, "Flat Squares": 1, Squares: 2, Spheres: 3 };

const VERTEX = `
attribute vec4 tint;
uniform float size;
uniform float metric;
uniform float perDepth;
uniform float height;
uniform float number;
varying vec4 colour;
flat varying float own;
void main() {
  colour = tint;
  own = number < 0.0 ? -number : number + float(gl_VertexID);
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * place;
  float metre = projectionMatrix[1][1] * height * 0.5 / (isOrthographic ? 1.0 : max(-place.z, 1e-6));
  float pixels = metric > 0.5 ? (perDepth > 0.0 ? perDepth * position.z : size) * metre : size;
  gl_PointSize = max(1.0, pixels);
  // A point is drawn as at least one pixel. Of smaller ones, as many are drawn as together cover the right area.
  float chance = fract(sin(float(gl_VertexID) * 12.9898) * 43758.5453);
  if (number == 0.0 && chance >= pixels * pixels) gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
}`;

const FRAGMENT = `
uniform int style;
uniform float alpha;
uniform float number;
varying vec4 colour;
flat varying float own;
${NUMBER_TINT}
void main() {
  vec2 at = gl_PointCoord * 2.0 - 1.0;
  vec3 rgb = colour.rgb;
  if (style == 0 || style == 3) {
    float radius = dot(at, at);
    if (radius > 1.0) discard;
    if (style == 3) rgb *= 1.0 - 0.2 * radius;
  }
  if (number != 0.0) {
    gl_FragColor = tintOf(own);
    return;
  }
  if (style == 2 && max(abs(at.x), abs(at.y)) > 0.95) rgb = dot(rgb, vec3(1.0)) > 1.5 ? rgb * 0.8 : rgb * 1.2;
  gl_FragColor = vec4(rgb, colour.a * alpha);
}`;

// Of the six faces, only three can face the viewer. Each face has its own constant shade, as in rviz without geometry
// shaders.
const BOX_VERTEX = `
uniform vec3 sizes;
uniform float perDepth;
uniform float number;
uniform vec4 eye;
flat varying vec4 colour;
varying vec2 place;
flat varying float own;
void main() {
  int box = gl_VertexID / 18;
  int corner = gl_VertexID % 6;
  int axis = gl_VertexID % 18 / 6;
  own = number < 0.0 ? -number : number + float(box);
  vec4 tint;
  vec3 middle = placeOf(box, tint);
  vec3 extent = perDepth > 0.0 ? abs(vec3(perDepth * middle.z)) : sizes;
  float towards = (eye.xyz - eye.w * middle)[axis];
  // In rviz, an odd number of negative sizes turns a box inside out: its far faces are visible instead of its near ones.
  bool isUpper = (towards > 0.0) == (extent.x * extent.y * extent.z >= 0.0);
  if (!(abs(towards) > 0.5 * eye.w * abs(extent[axis]))) {
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
    return;
  }
  place = vec2(corner == 1 || corner >= 4, corner == 2 || corner == 3 || corner == 5);
  vec2 across = place - 0.5;
  isUpper = isUpper == (extent[axis] >= 0.0);
  float along = isUpper ? 0.5 : -0.5;
  vec3 at = axis == 0 ? vec3(along, across) : axis == 1 ? vec3(across.y, along, across.x) : vec3(across, along);
  float shade = axis == 2 ? (isUpper ? 0.9 : 0.5) : axis == 0 ? 0.6 : isUpper ? 0.4 : 1.0;
  colour = vec4(tint.rgb * shade, tint.a);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(middle + at * extent, 1.0);
}`;

const BOX_FRAGMENT = `
uniform float alpha;
uniform float number;
flat varying vec4 colour;
varying vec2 place;
flat varying float own;
${NUMBER_TINT}
void main() {
  if (number != 0.0) {
    gl_FragColor = tintOf(own);
    return;
  }
  vec2 at = abs(place * 2.0 - 1.0);
  vec3 rgb = max(at.x, at.y) > 0.95 ? colour.rgb * 0.8 : colour.rgb;
  gl_FragColor = vec4(rgb, colour.a * alpha);
}`;

// Returns points in one of rviz's styles.
//   positions: x, y, z of each point (Float32Array)
//   tints: r, g, b, a of each point (Uint8Array)
//   size: metres, or pixels for the style Points; for Boxes a number or [x, y, z]
//   perDepth: if not 0, the size is this number times the point's z
export function points(style, positions, tints, size, alpha = 1, hasAlpha = false, perDepth = 0) {
  const isTransparent = alpha < OPAQUE || hasAlpha;
  const blending = { transparent: isTransparent, depthWrite: !isTransparent };
  if (style === "Boxes") return boxes(positions, tints, size, alpha, blending, perDepth);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
  geometry.setAttribute("tint", new THREE.BufferAttribute(tints, 4, true));
  if (!isTransparent) geometry.boundingSphere = new THREE.Sphere(); // otherwise it is computed from all points, to sort the objects
  const uniforms = { size: { value: size }, perDepth: { value: perDepth }, metric: { value: style === "Points" ? 0 : 1 },
    height: { value: 1 }, style: { value: STYLES[style] ?? 1 }, alpha: { value: alpha }, number: { value: 0 } };
  const material = new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms, ...blending });
  const made = new THREE.Points(geometry, material);
  made.frustumCulled = false;
  const buffer = new THREE.Vector2();
  made.onBeforeRender = (renderer) => {
    const target = renderer.getRenderTarget();
    uniforms.height.value = target ? target.height : renderer.getDrawingBufferSize(buffer).y;
    uniforms.size.value = style === "Points" && !target ? size * renderer.getPixelRatio() : size;
    material.uniformsNeedUpdate = true;
  };
  return made;
}

// Returns points that reuse the look and the buffers of `object`, which must have as many points, and is no longer drawn.
export function refilled(object, positions, tints) {
  const { geometry, material } = object;
  for (const [name, array] of [["position", positions], ["tint", tints]]) {
    const attribute = geometry.getAttribute(name);
    attribute.array = array;
    attribute.needsUpdate = true;
  }
  const made = new THREE.Points(geometry, material);
  made.frustumCulled = false;
  made.onBeforeRender = object.onBeforeRender;
  return made;
}

function boxes(positions, tints, size, alpha, blending, perDepth) {
  const sizes = new THREE.Vector3(...(Array.isArray(size) ? size : [size, size, size]));
  const eye = new THREE.Vector4();
  const mesh = drawnFromTexture(positions, tints, 18, {
    vertexShader: BOX_VERTEX,
    fragmentShader: BOX_FRAGMENT,
    half: sizes.clone().multiplyScalar(0.5),
    uniforms: { sizes: { value: sizes }, perDepth: { value: perDepth }, alpha: { value: alpha }, eye: { value: eye } },
    ...blending,
  });
  const inverse = new THREE.Matrix4();
  mesh.onBeforeRender = (_renderer, _scene, camera) => {
    // For an orthographic camera, the third column is the direction to the viewer.
    eye.fromArray(camera.matrixWorld.elements, camera.isOrthographicCamera ? 8 : 12).applyMatrix4(inverse.copy(mesh.matrixWorld).invert());
    mesh.material.uniformsNeedUpdate = true;
  };
  return mesh;
}
