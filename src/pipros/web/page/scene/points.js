// Many points in one object: discs, squares and boxes with a colour each.

import * as THREE from "three";
import { BOX, NUMBER_TINT, OPAQUE } from "./shapes.js";

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
  gl_PointSize = metric > 0.5 ? max(1.0, (perDepth > 0.0 ? perDepth * position.z : size) * metre) : size;
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

// Each face has its own constant shade, as in rviz without geometry shaders.
const BOX_VERTEX = `
attribute vec3 offset;
attribute vec4 tint;
uniform vec3 sizes;
uniform float perDepth;
uniform float number;
varying vec4 colour;
varying vec2 place;
flat varying float own;
void main() {
  own = number < 0.0 ? -number : number + float(gl_InstanceID);
  float shade = normal.z > 0.5 ? 0.9 : normal.z < -0.5 ? 0.5 : abs(normal.x) > 0.5 ? 0.6 : normal.y > 0.5 ? 0.4 : 1.0;
  colour = vec4(tint.rgb * shade, tint.a);
  place = uv;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(offset + position * (perDepth > 0.0 ? vec3(perDepth * offset.z) : sizes), 1.0);
}`;

const BOX_FRAGMENT = `
uniform float alpha;
uniform float number;
varying vec4 colour;
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

// Returns points of a style of rviz.
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
  const uniforms = { size: { value: size }, perDepth: { value: perDepth }, metric: { value: style === "Points" ? 0 : 1 }, height: { value: 1 }, style: { value: STYLES[style] ?? 1 }, alpha: { value: alpha }, number: { value: 0 } };
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

function boxes(positions, tints, size, alpha, blending, perDepth) {
  const geometry = new THREE.InstancedBufferGeometry();
  for (const name of ["position", "normal", "uv"]) geometry.setAttribute(name, BOX.getAttribute(name).clone());
  geometry.setIndex(BOX.getIndex().clone());
  geometry.setAttribute("offset", new THREE.InstancedBufferAttribute(positions, 3));
  geometry.setAttribute("tint", new THREE.InstancedBufferAttribute(tints, 4, true));
  geometry.instanceCount = positions.length / 3;
  const sizes = new THREE.Vector3(...(Array.isArray(size) ? size : [size, size, size]));
  const uniforms = { sizes: { value: sizes }, perDepth: { value: perDepth }, alpha: { value: alpha }, number: { value: 0 } };
  const material = new THREE.ShaderMaterial({ vertexShader: BOX_VERTEX, fragmentShader: BOX_FRAGMENT, uniforms, ...blending });
  const mesh = new THREE.Mesh(geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}
