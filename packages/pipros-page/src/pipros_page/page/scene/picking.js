// The point of the scene at a pixel, from the depth that is drawn there.

import * as THREE from "three";

const VERTEX = "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }";
const FRAGMENT = `
#include <packing>
uniform sampler2D depth;
void main() { gl_FragColor = packDepthToRGBA(texture2D(depth, vec2(0.5)).r); }`;

export const MARGIN = 64; // pixels drawn around the pixel that is read, because points whose centres are outside are not drawn

const SIZE = 2 * MARGIN + 1;

export class Picker {
  constructor(scene) {
    this.scene = scene;
    this.target = new THREE.WebGLRenderTarget(SIZE, SIZE, { depthTexture: new THREE.DepthTexture(SIZE, SIZE, THREE.FloatType) });
    this.packed = new THREE.WebGLRenderTarget(1, 1);
    const uniforms = { depth: { value: this.target.depthTexture } };
    this.material = new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms, depthTest: false });
    this.quad = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), this.material);
    this.quad.frustumCulled = false;
    this.flat = new THREE.Scene();
    this.flat.add(this.quad);
  }

  // Returns the point at a pixel of the canvas in the fixed frame, or null.
  point(x, y) {
    const depth = this.depth(x, y);
    if (depth >= 1) return null;
    const { camera } = this.scene.view;
    const { clientWidth: width, clientHeight: height } = this.scene.canvas;
    return new THREE.Vector3(((x + 0.5) / width) * 2 - 1, 1 - ((y + 0.5) / height) * 2, depth * 2 - 1).unproject(camera);
  }

  depth(x, y) {
    const { renderer, world, tools, view, canvas } = this.scene;
    const { camera } = view;
    camera.setViewOffset(canvas.clientWidth, canvas.clientHeight, x - MARGIN, y - MARGIN, SIZE, SIZE);
    tools.visible = false;
    renderer.setRenderTarget(this.target);
    renderer.clear();
    renderer.render(world, camera);
    camera.clearViewOffset();
    tools.visible = true;
    renderer.setRenderTarget(this.packed);
    renderer.render(this.flat, camera);
    const bytes = new Uint8Array(4);
    renderer.readRenderTargetPixels(this.packed, 0, 0, 1, 1, bytes);
    renderer.setRenderTarget(null);
    // The inverse of packDepthToRGBA: 8 bits in each channel, the coarsest first.
    return Math.min(1, bytes[0] / 256 + bytes[1] / 65536 + bytes[2] / 16777216 + bytes[3] / 4294967296);
  }

  // Returns where the ray through a pixel meets the plane z = 0 of the fixed frame, or null.
  ground(x, y) {
    const { camera } = this.scene.view;
    const { clientWidth: width, clientHeight: height } = this.scene.canvas;
    const caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2(((x + 0.5) / width) * 2 - 1, 1 - ((y + 0.5) / height) * 2), camera);
    return caster.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), 0), new THREE.Vector3());
  }
}
