// The Measure tool: the distance between two points.

import { replace } from "../dom.js";
import { clear, thinLines } from "./shapes.js";

export class Measuring {
  constructor(scene, status) {
    this.scene = scene;
    this.status = status;
    this.points = [];
  }

  // Adds a point. A third point begins a new measurement; null clears the measurement.
  add(point) {
    if (!point || this.points.length > 1) this.points = [];
    if (point) this.points.push(point);
    clear(this.scene.tools);
    this.scene.invalidate();
    if (this.points.length < 2) return;
    const [a, b] = this.points;
    this.scene.tools.add(thinLines([a.x, a.y, a.z, b.x, b.y, b.z], [255, 255, 0]));
    replace(this.status, `[Length: ${a.distanceTo(b).toFixed(2)}m]`);
  }
}
