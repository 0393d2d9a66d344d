// Many solid shapes in few objects, because each object takes time to draw.
//
// The places, sizes and colours of the shapes are in a texture, from which the vertex shader reads them. There is an object
// for each level of detail: its geometry has copies of the level's shape, and a second texture has the numbers of the shapes
// that are drawn with this detail. The smallest ones are points (small_solids.js). InstancedMesh would need no copies, but
// in software rendering, each of its instances takes as long as 200 triangles.

import * as THREE from "three";
import { NUMBER_TINT, blended } from "./shapes.js";
import { smallSolids } from "./small_solids.js";

const WORDS = 16; // numbers of a shape in the texture: three rows of its matrix, and its colour
const TEXELS = WORDS / 4;
const ACROSS = 256; // shapes in a row of a texture
const FIRST = 64; // shapes for which there is room at first

// Reads the number of the shape for a copy, and what the texture says about a shape.
const READ = `
uniform highp sampler2D shapes;
uniform highp usampler2D order;
int shapeOf(int copy) { return int(texelFetch(order, ivec2(copy % ${ACROSS}, copy / ${ACROSS}), 0).r); }
void readShape(int shape, out mat3 turned, out vec3 place, out vec4 tint) {
  ivec2 at = ivec2(shape % ${ACROSS} * ${TEXELS}, shape / ${ACROSS});
  vec4 x = texelFetch(shapes, at, 0);
  vec4 y = texelFetch(shapes, at + ivec2(1, 0), 0);
  vec4 z = texelFetch(shapes, at + ivec2(2, 0), 0);
  tint = texelFetch(shapes, at + ivec2(3, 0), 0);
  turned = transpose(mat3(x.xyz, y.xyz, z.xyz));
  place = vec3(x.w, y.w, z.w);
}`;

// The light comes from the viewer (headlight.js), so a surface is the brighter, the more directly it faces the viewer.
const VERTEX = `
${READ}
uniform float number;
flat varying float own;
flat varying vec4 tint;
varying vec3 facing;
void main() {
  int shape = shapeOf(gl_VertexID / EACH);
  mat3 turned;
  vec3 place;
  readShape(shape, turned, place, tint);
  own = number < 0.0 ? -number : number + float(shape);
  vec3 sizes = max(vec3(dot(turned[0], turned[0]), dot(turned[1], turned[1]), dot(turned[2], turned[2])), vec3(1e-30));
  facing = normalMatrix * (turned * (normal / sizes));
  gl_Position = projectionMatrix * modelViewMatrix * vec4(turned * position + place, 1.0);
}`;

const FRAGMENT = `
uniform float number;
uniform float lamp;
flat varying float own;
flat varying vec4 tint;
varying vec3 facing;
${NUMBER_TINT}
void main() {
  float shade = max(0.0, normalize(facing).z) * lamp;
  gl_FragColor = number != 0.0 ? tintOf(own) : vec4(tint.rgb * shade, tint.a);
}`;

export class BatchOfSolids {
  // `levels` has {shape, pixels}, the finest first: the geometry of a solid of size 1, or the kind of a small solid, and the size on
  // the screen down to which it is drawn.
  constructor(levels, isTransparent) {
    this.object = new THREE.Group();
    this.free = [];
    this.count = 0; // shapes that were ever used
    this.uniforms = { shapes: { value: null }, number: { value: 0 }, lamp: { value: 1 } };
    this.levels = levels.map((level) => new Level(level, this.uniforms, isTransparent));
    this.object.add(...this.levels.map(({ mesh }) => mesh));
    this.grow(FIRST);
  }

  grow(room) {
    const before = this.words;
    const rows = Math.ceil(room / ACROSS);
    this.room = rows * ACROSS;
    this.words = new Float32Array(this.room * WORDS);
    if (before) this.words.set(before);
    this.texture?.dispose();
    this.texture = new THREE.DataTexture(this.words, ACROSS * TEXELS, rows, THREE.RGBAFormat, THREE.FloatType);
    this.uniforms.shapes.value = this.texture;
    this.texture.needsUpdate = true;
  }

  // Returns the number of a new shape, which is invisible until `set` is called.
  add() {
    const index = this.free.pop();
    if (index !== undefined) return index;
    if (this.count >= this.room) this.grow(2 * this.room);
    this.count += 1;
    return this.count - 1;
  }

  // Places a shape. `matrix` is a Matrix4, `color` has r, g, b and a from 0 to 1.
  set(index, { elements: m }, { r, g, b, a }) {
    const { words } = this;
    let at = index * WORDS;
    for (let row = 0; row < 3; row += 1) for (let column = 0; column < 16; column += 4) words[at++] = m[row + column];
    words[at] = r;
    words[at + 1] = g;
    words[at + 2] = b;
    words[at + 3] = a;
    this.texture.needsUpdate = true;
  }

  hide(index) {
    this.words.fill(0, index * WORDS, (index + 1) * WORDS); // a size of 0
    this.texture.needsUpdate = true;
  }

  remove(index) {
    this.hide(index);
    this.free.push(index);
  }

  get isEmpty() {
    return this.free.length === this.count;
  }

  // Returns the box around a shape.
  box(index) {
    const w = this.words.subarray(index * WORDS);
    const matrix = new THREE.Matrix4(w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8], w[9], w[10], w[11], 0, 0, 0, 1);
    return new THREE.Box3(new THREE.Vector3(-0.5, -0.5, -0.5), new THREE.Vector3(0.5, 0.5, 0.5)).applyMatrix4(matrix);
  }

  // Called before each picture: gives each shape the detail that its size on the screen needs, or with `isFinest` the finest.
  //   height: of the picture, in pixels; lamp: the brightness of the light, from 0 to 1
  arrange(camera, height, lamp, isFinest) {
    this.uniforms.lamp.value = lamp;
    const { words } = this;
    const scale = (camera.projectionMatrix.elements[5] * height) / 2;
    const [ex, ey, ez] = camera.matrixWorld.elements.slice(12);
    const chosen = this.levels.map(() => []);
    for (let index = 0, w = 0; index < this.count; index += 1, w += WORDS) {
      const size = Math.sqrt(Math.max(words[w] ** 2 + words[w + 4] ** 2 + words[w + 8] ** 2,
        words[w + 1] ** 2 + words[w + 5] ** 2 + words[w + 9] ** 2, words[w + 2] ** 2 + words[w + 6] ** 2 + words[w + 10] ** 2));
      if (size === 0) continue;
      const away = camera.isOrthographicCamera ? 1 : Math.hypot(words[w + 3] - ex, words[w + 7] - ey, words[w + 11] - ez);
      const pixels = (size * scale) / Math.max(away, 1e-6);
      const at = isFinest ? 0 : this.levels.findIndex(({ least }) => pixels >= least);
      chosen[at < 0 ? chosen.length - 1 : at].push(index);
    }
    this.levels.forEach((level, number) => level.show(chosen[number]));
  }

  dispose() {
    this.texture.dispose();
    for (const level of this.levels) level.dispose();
  }
}

// The shapes that are drawn with the same detail.
class Level {
  constructor({ shape, pixels }, uniforms, isTransparent) {
    this.least = pixels;
    this.room = 0;
    this.order = { value: null };
    const all = { ...uniforms, order: this.order };
    const isSmall = typeof shape === "string";
    this.shape = isSmall ? null : shape;
    this.each = isSmall ? 1 : shape.getIndex().count; // vertices of a shape, as they are drawn
    this.mesh = isSmall ? smallSolids(shape, READ, all, isTransparent) : new THREE.Mesh(new THREE.BufferGeometry(),
      new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: all,
        defines: { EACH: shape.getAttribute("position").count }, ...blended(isTransparent ? 0 : 1) }));
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  show(indices) {
    this.mesh.visible = indices.length > 0;
    if (!indices.length) return;
    if (indices.length > this.room) this.grow(indices.length);
    const { data } = this.order.value.image;
    if (indices.length !== this.count || indices.some((index, at) => data[at] !== index)) {
      data.set(indices);
      this.order.value.needsUpdate = true;
    }
    this.count = indices.length;
    this.mesh.geometry.setDrawRange(0, this.count * this.each);
  }

  grow(count) {
    this.room = Math.max(FIRST, 2 ** Math.ceil(Math.log2(count)));
    const rows = Math.ceil(this.room / ACROSS);
    this.order.value?.dispose();
    const numbers = new Uint32Array(rows * ACROSS);
    this.order.value = new THREE.DataTexture(numbers, ACROSS, rows, THREE.RedIntegerFormat, THREE.UnsignedIntType);
    this.order.value.internalFormat = "R32UI";
    if (this.shape) {
      this.mesh.geometry.dispose();
      this.mesh.geometry = copies(this.shape, this.room);
    }
    this.count = 0;
  }

  dispose() {
    this.order.value?.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

// Returns a geometry of `count` copies of a shape.
function copies(shape, count) {
  const made = new THREE.BufferGeometry();
  for (const name of ["position", "normal"]) {
    const { array } = shape.getAttribute(name);
    const values = new Float32Array(array.length * count);
    for (let i = 0; i < count; i += 1) values.set(array, i * array.length);
    made.setAttribute(name, new THREE.BufferAttribute(values, 3));
  }
  const { array: corners } = shape.getIndex();
  const vertices = shape.getAttribute("position").count;
  const index = new Uint32Array(corners.length * count);
  for (let i = 0; i < count; i += 1) for (let j = 0; j < corners.length; j += 1) index[i * corners.length + j] = i * vertices + corners[j];
  made.setIndex(new THREE.BufferAttribute(index, 1));
  return made;
}
