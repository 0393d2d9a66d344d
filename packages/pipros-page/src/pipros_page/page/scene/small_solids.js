// Solids that are small on the screen, as points: in software, a point takes a fraction of the time of a solid's triangles.
//
// The fragment shader finds where the ray through a pixel meets the solid. All rays of one solid are taken as parallel, so the
// distances at which a ray enters and leaves a slab between two parallel faces are linear over the point, and few operations are left
// for each pixel.

import * as THREE from "three";
import { NUMBER_TINT, blended } from "./shapes.js";

// In the solid's own coordinates, the ray through the middle is `along`, and right and down are the steps to the point's edges.
const OWN = `
flat varying float own;
flat varying vec4 tint;
flat varying vec3 right;
flat varying vec3 down;
flat varying vec3 along;
flat varying vec3 facing; // the brightness of the three kinds of faces
`;

const VERTEX = `
uniform float number;
uniform float height;
uniform float lamp;
${OWN}
void main() {
  int shape = shapeOf(gl_VertexID);
  mat3 turned;
  vec3 place;
  readShape(shape, turned, place, tint);
  own = number < 0.0 ? -number : number + float(shape);
  mat3 seen = mat3(modelViewMatrix) * turned;
  vec4 middle = modelViewMatrix * vec4(place, 1.0);
  gl_Position = projectionMatrix * middle;
  float metre = projectionMatrix[1][1] * height * 0.5 / (isOrthographic ? 1.0 : max(-middle.z, 1e-6));
  vec3 reach = 0.5 * (abs(seen[0]) + abs(seen[1]) + abs(seen[2]));
#if defined(BALL)
  mat3 rows = transpose(seen);
  reach = 0.5 * vec3(length(rows[0]), length(rows[1]), 0.0);
#elif defined(TUBE)
  reach.xy = 0.5 * (vec2(length(vec2(seen[0].x, seen[1].x)), length(vec2(seen[0].y, seen[1].y))) + abs(seen[2].xy));
#endif
  gl_PointSize = max(1.0, 2.0 * max(reach.x, reach.y) * metre);
  bool isTiny = gl_PointSize < 2.5; // then all pixels have the same brightness
  float radius = isTiny ? 0.0 : gl_PointSize / (2.0 * metre);
#if defined(BALL)
  right.xy = radius / reach.xy;
  along.x = isTiny ? 0.55 : 0.0; // for the mean brightness of a ball
#else
  mat3 back = inverse(seen);
  along = back * (isOrthographic ? vec3(0.0, 0.0, -1.0) : normalize(middle.xyz));
  along += vec3(equal(along, vec3(0.0))) * 1e-9;
  mat3 normals = transpose(back);
  facing = vec3(normals[0].z / length(normals[0]), normals[1].z / length(normals[1]), normals[2].z / length(normals[2])) * lamp;
  right = back[0] * radius;
  down = back[1] * -radius;
#if defined(BOX)
  facing = abs(facing);
  right /= along;
  down /= along;
  along = 0.5 / abs(along);
#else
  facing.xy *= 2.0;
  facing.z = abs(facing.z);
#endif
#endif
}`;

const FRAGMENT = `
uniform float number;
uniform float lamp;
${OWN}
${NUMBER_TINT}
void main() {
  vec2 at = gl_PointCoord * 2.0 - 1.0;
  float shade;
#if defined(BOX)
  vec3 middle = -at.x * right - at.y * down;
  vec3 enters = middle - along;
  vec3 leaves = middle + along;
  float first = max(max(enters.x, enters.y), enters.z);
  if (first > min(min(leaves.x, leaves.y), leaves.z)) discard;
  shade = enters.x == first ? facing.x : enters.y == first ? facing.y : facing.z;
#elif defined(BALL)
  at *= right.xy;
  float outside = dot(at, at) + along.x;
  if (outside > 1.0) discard;
  shade = sqrt(1.0 - outside) * lamp;
#else
  vec3 from = at.x * right + at.y * down;
  float a = dot(along.xy, along.xy);
  float b = dot(from.xy, along.xy);
  float inside = b * b - a * (dot(from.xy, from.xy) - 0.25);
  if (inside < 0.0) discard;
  vec2 side = (vec2(-1.0, 1.0) * sqrt(inside) - b) / a;
  float enters = (-0.5 * sign(along.z) - from.z) / along.z;
  float leaves = (0.5 * sign(along.z) - from.z) / along.z;
  if (max(side.x, enters) > min(side.y, leaves)) discard;
  shade = enters > side.x ? facing.z : clamp(dot(from.xy + side.x * along.xy, facing.xy), 0.0, lamp);
#endif
  gl_FragColor = number != 0.0 ? tintOf(own) : vec4(tint.rgb * shade, tint.a);
}`;

// Returns points that draw small solids. `kind` is BOX, BALL or TUBE; `read` is the code of `shapeOf` and `readShape`.
export function smallSolids(kind, read, uniforms, isTransparent) {
  const height = { value: 1 };
  const material = new THREE.ShaderMaterial({
    vertexShader: read + VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: { ...uniforms, height },
    defines: { [kind]: "" },
    ...blended(isTransparent ? 0 : 1),
  });
  const made = new THREE.Points(new THREE.BufferGeometry(), material);
  const buffer = new THREE.Vector2();
  made.onBeforeRender = (renderer) => {
    height.value = renderer.getRenderTarget()?.height ?? renderer.getDrawingBufferSize(buffer).y;
    material.uniformsNeedUpdate = true;
  };
  return made;
}
