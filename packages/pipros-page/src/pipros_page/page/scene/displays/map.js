// Occupancy grids, with updates of parts of them.

import * as THREE from "three";
import { mapPalette } from "../colours.js";
import { Display, withoutSlash } from "../display.js";
import { normalized, poseOf } from "../pose.js";
import { OPAQUE, clear, place } from "../shapes.js";

const VERTEX = "varying vec2 cell; void main() { cell = uv; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }";
const FRAGMENT = `
uniform sampler2D cells;
uniform sampler2D palette;
uniform float alpha;
varying vec2 cell;
void main() {
  float value = texture2D(cells, cell).r * 255.0;
  vec4 colour = texture2D(palette, vec2((value + 0.5) / 256.0, 0.5));
  gl_FragColor = vec4(colour.rgb, colour.a * alpha);
}`;

export class MapDisplay extends Display {
  begin() {
    this.map = null;
    this.setStatus("Message", "warning", "No map received");
    this.subscribe("Topic", (message) => this.take(message), { queue: 1, isCounted: false });
    const topic = this.scene.topicName(this.get("Topic"));
    if (!topic) return;
    this.setStatus("Update Topic", "ok", "OK");
    this.stops.push(this.scene.subscribe(`${topic}_updates`, 100, (update) => this.update(update)));
  }

  // Maps are latched, so the map stays until the next message.
  reset() {}

  end() {
    clear(this.root);
    this.map = null;
  }

  take(message) {
    const { width, height, resolution, origin } = message.info;
    clear(this.root);
    this.map = null;
    if (!width || !height) return this.setStatus("Map", "error", `Map is zero-sized (${width}x${height})`);
    if (message.data.length !== width * height) return this.setStatus("Map", "error",
      `Data size doesn't match width*height: width = ${width}, height = ${height}, data size = ${message.data.length}`);
    const most = this.scene.renderer.capabilities.maxTextureSize;
    if (width > most || height > most) return this.setStatus("Map", "error",
      `The map has ${width}x${height} cells; this browser's graphics card allows at most ${most} per side`);
    if (![...poseOf(origin), resolution].every(Number.isFinite))
      return this.setStatus("Map", "error", "Message contained invalid floating point values (nans or infs)");
    this.setStatus("Message", "ok", "Map received");
    this.setStatus("Map", "ok", "Map OK");
    const cells = new Uint8Array(message.data.buffer, message.data.byteOffset, message.data.length);
    const texture = new THREE.DataTexture(cells, width, height, THREE.RedFormat);
    texture.unpackAlignment = 1;
    texture.needsUpdate = true;
    const palette = new THREE.DataTexture(mapPalette(this.get("Color Scheme")), 256, 1);
    palette.needsUpdate = true;
    const alpha = this.get("Alpha");
    const isOpaque = this.get("Color Scheme") === "map" && alpha >= OPAQUE;
    const isBehind = this.get("Draw Behind");
    const material = new THREE.ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { cells: { value: texture }, palette: { value: palette }, alpha: { value: alpha } },
      side: THREE.DoubleSide,
      transparent: !isOpaque && !isBehind,
      depthWrite: isOpaque && !isBehind,
      // Objects without `transparent` are drawn first; with custom blending, they are blended nevertheless.
      blending: isBehind ? THREE.CustomBlending : THREE.NormalBlending,
      // As in rviz, the map is drawn a little farther away, so that what lies on it is seen.
      polygonOffset: !isBehind,
      polygonOffsetUnits: 16,
    });
    const mesh = new THREE.Mesh(new THREE.PlaneGeometry(1, 1).translate(0.5, 0.5, 0), material);
    mesh.scale.set(width * resolution, height * resolution, 1);
    mesh.renderOrder = isBehind ? -10 : -1; // before other transparent objects, which may lie on the map
    const holder = new THREE.Group();
    place(holder, normalized(poseOf(origin)));
    holder.add(mesh);
    this.root.add(holder);
    this.map = { cells, width, height, texture, frame: withoutSlash(message.header.frame_id) || "map", stamp: message.header.stamp };
    this.scene.invalidate();
    return undefined;
  }

  update({ x, y, width, height, data }) {
    const { map } = this;
    if (!map) return;
    if (x < 0 || y < 0 || x + width > map.width || y + height > map.height || data.length < width * height) {
      this.setStatus("Update", "error", "Update area outside of original map area.");
      return;
    }
    this.setStatus("Update", "ok", "Update OK");
    for (let row = 0; row < height; row += 1) map.cells.set(data.subarray(row * width, (row + 1) * width), (y + row) * map.width + x);
    map.texture.needsUpdate = true;
    this.scene.invalidate();
  }

  frame() {
    if (!this.map) return;
    if (this.get("Use Timestamp")) {
      try {
        place(this.root, this.scene.poseOf(this.map.frame, this.map.stamp));
        this.setStatus("Transform", "ok", "Transform OK");
        return;
      } catch {
        // use the newest transform instead
      }
    }
    this.follow(this.map.frame);
  }
}
