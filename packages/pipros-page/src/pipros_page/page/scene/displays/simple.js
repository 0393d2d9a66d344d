// Displays that draw a fixed shape at a frame: Grid and Axes.

import * as THREE from "three";
import { Display } from "../display.js";
import { OPAQUE, axes, clear, thinLines, wideLines } from "../shapes.js";

const MAX_CELLS = 2000;

// Follows the reference frame, and is not affected by messages.
class Fixed extends Display {
  reset() {}

  end() {
    clear(this.root);
  }

  frame() {
    this.follow(this.get("Reference Frame"), (name, error) => this.scene.whyNot(name, error));
  }
}

export class Grid extends Fixed {
  begin() {
    clear(this.root);
    const count = Math.min(MAX_CELLS, Math.max(1, this.get("Plane Cell Count")));
    const layers = Math.min(100, Math.max(0, this.get("Normal Cell Count")));
    const size = this.get("Cell Size");
    const points = gridPoints(count, layers, size);
    const [rgb, alpha] = [this.get("Color"), this.get("Alpha")];
    const isWide = this.get("Line Style") === "Billboards";
    const lines = isWide ? wideLines(points, this.get("Line Style", "Line Width"), [...rgb.map((part) => part / 255), alpha],
      alpha < OPAQUE) : thinLines(points, rgb, alpha);
    // The lines are made in the plane XY.
    const plane = this.get("Plane");
    if (plane === "XZ") lines.quaternion.setFromAxisAngle(new THREE.Vector3(1, 0, 0), -Math.PI / 2);
    if (plane === "YZ") lines.quaternion.setFromAxisAngle(new THREE.Vector3(0, 1, 0), Math.PI / 2);
    lines.position.set(...this.get("Offset"));
    this.root.add(lines);
  }
}

// Returns the ends of the lines of a grid around the origin.
function gridPoints(count, layers, size) {
  const extent = (size * count) / 2;
  const points = [];
  for (let layer = 0; layer <= layers; layer += 1) {
    const z = layers ? (layers / 2 - layer) * size : 0;
    for (let i = 0; i <= count; i += 1) {
      const at = extent - i * size;
      points.push(at, -extent, z, at, extent, z, -extent, at, z, extent, at, z);
    }
  }
  if (!layers) return points;
  const top = (layers / 2) * size;
  for (let x = 0; x <= count; x += 1) {
    for (let y = 0; y <= count; y += 1) points.push(extent - x * size, extent - y * size, top, extent - x * size, extent - y * size, -top);
  }
  return points;
}

export class Axes extends Fixed {
  begin() {
    clear(this.root);
    this.root.add(axes(this.get("Length"), this.get("Radius"), this.get("Alpha")));
  }
}
