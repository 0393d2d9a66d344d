// Paths, poses, odometry, polygons, points, cells and ranges: drawn at the pose of their frame at the message's stamp.

import * as THREE from "three";
import { covarianceShapes } from "../covariance.js";
import { Display } from "../display.js";
import { composed, isFinitePose, normalized, poseOf, poseTexts } from "../pose.js";
import { CONE, SPHERE, arrow, axes, dispose, lit, place, segments, thinLines, unlit, wideLines } from "../shapes.js";

const INVALID = "Message contained invalid floating point values (nans or infs)";
const MAX_POSES = 20000;

// Shows the newest messages, each as one object.
export class Placed extends Display {
  begin() {
    this.subscribe("Topic", (message) => this.whenPlaced(message, (each, pose) => this.take(each, pose)));
  }

  // Number of messages that are shown; 0 means MAX_POSES.
  get most() {
    return 1;
  }

  take(message, pose) {
    const object = this.draw(message, pose);
    if (!object) return;
    const holder = new THREE.Group();
    place(holder, pose);
    holder.add(object);
    holder.userData.texts = [["Frame", message.header.frame_id],
      ...poseTexts(composed(pose, [...object.position.toArray(), ...object.quaternion.toArray()]))];
    this.root.add(holder);
    const most = this.most || MAX_POSES;
    while (this.root.children.length > most) {
      const [first] = this.root.children;
      this.root.remove(first);
      dispose(first);
    }
    this.scene.invalidate();
  }

  selectables() {
    return this.root.children.map((object) => ({ label: this.name, object, describe: () => object.userData.texts }));
  }

  // Returns the object for a message in its frame, or null. Overridden by each display.
  draw(_message, _pose) {
    return null;
  }

  refuse() {
    this.setStatus("Topic", "error", INVALID);
    return null;
  }

  // Returns a pose of a message, normalized; null if it or the other numbers are not finite.
  checkedPose(pose, others = []) {
    const own = poseOf(pose);
    if (!isFinitePose(own) || !others.every(Number.isFinite)) return this.refuse();
    this.noteRotations([own]);
    return normalized(own);
  }

  // Warns if a pose has no rotation.
  noteRotations(poses) {
    if (poses.some((pose) => pose.slice(3).every((part) => part === 0)))
      this.setStatus("Message", "warning", "Uninitialized quaternion, assuming identity.");
    else this.dropStatus("Message");
  }

  // Returns an arrow or axes, as the display's properties specify.
  poseShape(prefix = []) {
    const get = (name) => this.get(...prefix, name);
    const kind = this.get("Shape");
    if (kind === "Axes") return axes(get("Axes Length"), get("Axes Radius"),
      this.properties.find([...prefix, "Alpha"])[0] ? get("Alpha") : 1);
    return arrow(get("Shaft Length"), get("Shaft Radius"), get("Head Length"), get("Head Radius"), lit(get("Color"), get("Alpha")));
  }
}

export class Path extends Placed {
  get most() {
    return Math.max(1, this.get("Buffer Length"));
  }

  draw(message) {
    const group = new THREE.Group();
    group.position.set(...this.get("Offset"));
    const poses = message.poses.map(({ pose }) => poseOf(pose));
    if (!poses.every(isFinitePose)) return this.refuse();
    const strip = poses.flatMap((pose) => pose.slice(0, 3));
    const [rgb, alpha] = [this.get("Color"), this.get("Alpha")];
    if (this.get("Line Style") === "Billboards")
      group.add(wideLines(segments(strip), this.get("Line Width"), [...rgb.map((part) => part / 255), alpha], alpha < 0.9998));
    else group.add(thinLines(strip, rgb, 1, { isStrip: true }));
    const style = this.get("Pose Style");
    if (style === "None") return group;
    for (const pose of poses.slice(0, MAX_POSES)) {
      const shape = style === "Axes" ? axes(this.get("Length"), this.get("Radius")) : arrow(this.get("Shaft Length"),
        this.get("Shaft Diameter"), this.get("Head Length"), this.get("Head Diameter"), lit(this.get("Pose Color")));
      place(shape, normalized(pose));
      group.add(shape);
    }
    return group;
  }
}

export class Pose extends Placed {
  draw({ pose }) {
    const own = this.checkedPose(pose);
    const shape = own && this.poseShape();
    if (shape) place(shape, own);
    return shape;
  }
}

export class PoseWithCovariance extends Placed {
  draw({ pose: { pose, covariance } }) {
    const own = this.checkedPose(pose, covariance);
    return own && withCovariance(this, this.poseShape(), own, covariance);
  }
}

function withCovariance(display, shape, pose, covariance) {
  const group = new THREE.Group();
  place(shape, pose);
  group.add(shape);
  if (!display.get("Covariance")) return group;
  const { fixed, turning } = covarianceShapes(covariance, (...path) => display.get("Covariance", ...path));
  fixed.position.set(pose[0], pose[1], pose[2]);
  place(turning, pose);
  group.add(fixed, turning);
  return group;
}

export class Odometry extends Placed {
  begin() {
    this.last = null;
    super.begin();
  }

  reset() {
    super.reset();
    this.last = null;
  }

  get most() {
    return Math.max(0, this.get("Keep"));
  }

  draw({ pose: { pose, covariance } }) {
    const here = this.checkedPose(pose, covariance);
    if (!here || (this.last && !this.hasMoved(here))) return null;
    this.last = here;
    // Only the newest pose shows its covariance.
    const latest = this.root.children.at(-1)?.children[0];
    if (latest) latest.children.slice(1).forEach((each) => { each.visible = false; });
    return withCovariance(this, this.poseShape(["Shape"]), here, covariance);
  }

  hasMoved(here) {
    const { last } = this;
    const distance = Math.hypot(here[0] - last[0], here[1] - last[1], here[2] - last[2]);
    const dot = Math.min(1, Math.abs(here[3] * last[3] + here[4] * last[4] + here[5] * last[5] + here[6] * last[6]));
    return distance >= this.get("Position Tolerance") || 2 * Math.acos(dot) >= this.get("Angle Tolerance");
  }
}

export class PoseArray extends Placed {
  draw({ poses }) {
    const own = poses.slice(0, MAX_POSES).map((pose) => poseOf(pose));
    if (!own.every(isFinitePose)) return this.refuse();
    this.noteRotations(own);
    const [kind, rgb, alpha] = [this.get("Shape"), this.get("Color"), this.get("Alpha")];
    if (kind === "Arrow (Flat)") return thinLines(flatArrows(own, this.get("Arrow Length")), rgb, alpha);
    const group = new THREE.Group();
    const material = lit(rgb, alpha);
    for (const pose of own) {
      const shape = kind === "Axes" ? axes(this.get("Axes Length"), this.get("Axes Radius"), alpha)
        : arrow(this.get("Shaft Length"), this.get("Shaft Radius"), this.get("Head Length"), this.get("Head Radius"), material);
      place(shape, normalized(pose));
      group.add(shape);
    }
    return group;
  }
}

// Returns the ends of the lines of flat arrows along +x.
function flatArrows(poses, length) {
  const at = [[0, 0], [length, 0], [length, 0], [0.75 * length, 0.2 * length], [length, 0], [0.75 * length, -0.2 * length]];
  return poses.flatMap((pose) => at.flatMap(([x, y]) => composed(normalized(pose), [x, y, 0, 0, 0, 0, 1]).slice(0, 3)));
}

export class Polygon extends Placed {
  draw({ polygon: { points } }) {
    const strip = points.flatMap(({ x, y, z }) => [x, y, z]);
    if (!strip.every(Number.isFinite)) return this.refuse();
    return thinLines([...strip, ...strip.slice(0, 3)], this.get("Color"), 1, { isStrip: true });
  }
}

export class PointStamped extends Placed {
  get most() {
    return Math.max(1, this.get("History Length"));
  }

  draw({ point: { x, y, z } }) {
    if (![x, y, z].every(Number.isFinite)) return this.refuse();
    const mesh = new THREE.Mesh(SPHERE, lit(this.get("Color"), this.get("Alpha")));
    mesh.scale.setScalar(2 * this.get("Radius"));
    mesh.position.set(x, y, z);
    return mesh;
  }
}

export class GridCells extends Placed {
  draw({ cells, cell_width: width, cell_height: height }) {
    if (width === 0 || height === 0) {
      this.setStatus("Topic", "error", width ? "Cell height is zero, cells will be invisible."
        : "Cell width is zero, cells will be invisible.");
      return null;
    }
    if (![width, height, ...cells.map(({ x, y, z }) => x + y + z)].every(Number.isFinite)) return this.refuse();
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]];
    const points = cells.flatMap(({ x, y, z }) => corners.flatMap(([u, v]) => [x + (u * width) / 2, y + (v * height) / 2, z]));
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(points), 3));
    return new THREE.Mesh(geometry, unlit(this.get("Color"), this.get("Alpha"), { side: THREE.DoubleSide }));
  }
}

export class Range extends Placed {
  get most() {
    return Math.max(1, this.get("Buffer Length"));
  }

  draw(message) {
    if (Number.isNaN(message.range) || !Number.isFinite(message.field_of_view)) return this.refuse();
    const length = shownRange(message);
    const mesh = new THREE.Mesh(CONE, lit(this.get("Color"), this.get("Alpha")));
    const width = 2 * length * Math.tan(message.field_of_view / 2);
    mesh.scale.set(width || 1e-9, width || 1e-9, length || 1e-9);
    mesh.rotation.y = -Math.PI / 2; // the tip is at the sensor
    mesh.position.x = length / 2;
    return mesh;
  }
}

function shownRange({ range, min_range: min, max_range: max }) {
  if (min === max) return range === -Infinity ? min : 0;
  return range >= min && range <= max ? range : 0;
}

