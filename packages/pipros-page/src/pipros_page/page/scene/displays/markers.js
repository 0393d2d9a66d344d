// visualization_msgs/Marker and MarkerArray.

import * as THREE from "three";
import { Display, withoutSlash } from "../display.js";
import { TransformError } from "../frames.js";
import { problemOf, warningOf } from "../marker_checks.js";
import { Batches, InBatch, OwnObject, isSolid } from "../marker_parts.js";
import { drawnMarker, rgbOf } from "../marker_shapes.js";
import { normalized, poseOf, poseTexts } from "../pose.js";
import { OPAQUE, blended, lit, place } from "../shapes.js";

const [ADD, DELETE, DELETE_ALL] = [0, 2, 3];
const MAX_MARKERS = 20000;
const MESH = 10;
const FEW = 100; // markers; beyond them, small shapes have fewer triangles, and transparent ones are not sorted by their distance

export class Markers extends Display {
  begin() {
    this.shown = new Map(); // "namespace/id" to {part, sender, message, until, isPlaced, isLost}
    this.batches = new Batches(this.root);
    this.namespaces = new Map(); // its keys are the known namespaces
  }

  reset() {
    this.batches?.clear();
    super.reset();
    this.shown = new Map();
    for (const name of [...this.statuses.keys()]) if (name.includes("/")) this.statuses.delete(name);
  }

  take(marker) {
    const key = `${marker.ns}/${marker.id}`;
    if (marker.action === DELETE_ALL) {
      for (const each of [...this.shown.keys()]) this.remove(each);
    } else if (marker.action === DELETE) this.remove(key);
    else if (marker.action === ADD) this.add(key, marker);
    else this.setStatus(key, "error", `Unknown action ${marker.action}`);
  }

  add(key, marker) {
    if (!this.isShown(marker.ns)) return;
    const problem = problemOf(marker);
    if (problem) {
      this.remove(key);
      this.setStatus(key, "error", problem);
      return;
    }
    const warning = warningOf(marker);
    if (warning) this.setStatus(key, "warning", warning);
    else this.dropStatus(key);
    const before = this.shown.get(key)?.sender;
    if (before && this.sender && before !== this.sender) this.setStatus("Id clash", "warning",
      `[${key}] is sent by [${before}] and by [${this.sender}], which overwrite each other.`);
    if (!this.shown.has(key) && this.shown.size >= MAX_MARKERS) {
      this.setStatus("Markers", "error", `At most ${MAX_MARKERS} markers are shown.`);
      return;
    }
    if (this.update(key, marker)) return;
    this.remove(key, false);
    const part = this.inBatch(marker) ?? new OwnObject(this.root, this.placed(marker, key));
    const entry = { part, sender: this.sender, message: marker, until: this.endOf(marker), isPlaced: false };
    this.shown.set(key, entry);
    this.locate(key, entry);
  }

  // Draws a cube, sphere or cylinder as a part of a batch, which has those of the same type, namespace and transparency.
  // Transparent ones are separate objects if there are few, because they are sorted by their distance. Returns null for others.
  inBatch(marker) {
    const isTransparent = marker.color.a < OPAQUE;
    if (!isSolid(marker.type) || (isTransparent && this.shown.size < FEW)) return null;
    return new InBatch(this.batches, isTransparent, marker);
  }

  // Returns the object of a marker at its pose, or null.
  placed(marker, key) {
    const object = this.draw(marker, key);
    if (object) place(object, normalized(poseOf(marker.pose)));
    return object;
  }

  // Changes a part of a batch to a newer message of the same type. Returns whether it did.
  update(key, marker) {
    const entry = this.shown.get(key);
    if (!(entry?.part instanceof InBatch) || entry.message.type !== marker.type) return false;
    if ((entry.message.color.a < OPAQUE) !== (marker.color.a < OPAQUE)) return false;
    entry.part.change(marker);
    Object.assign(entry, { sender: this.sender, message: marker, until: this.endOf(marker), isPlaced: false });
    this.locate(key, entry);
    return true;
  }

  // The time at which a marker ends; null if it stays.
  endOf(marker) {
    return marker.lifetime > 0n ? this.scene.now() + marker.lifetime : null;
  }

  remove(key, isGone = true) {
    const entry = this.shown.get(key);
    if (!entry) return;
    this.shown.delete(key);
    entry.part.remove();
    if (isGone) this.dropStatus(key);
  }

  isShown(namespace) {
    if (!this.namespaces.has(namespace) && this.namespaces.size < 1000) this.namespaces.set(namespace, 0);
    return this.isPartShown(namespace, true);
  }

  load() {
    return `${this.shown.size.toLocaleString("en-GB")} markers`;
  }

  parts() {
    return { key: "Namespaces", names: [...this.namespaces?.keys() ?? []] };
  }

  selectables() {
    const describe = ({ header, pose }) => [["Frame", header.frame_id], ...poseTexts(poseOf(pose))];
    const all = [...this.shown ?? []];
    const single = all.filter(([, { part }]) => part instanceof OwnObject);
    const batches = [...this.batches?.all.values() ?? []].map((batch) => {
      const entry = (index) => [...this.shown].find(([, { part }]) => part.batch === batch && part.index === index) ?? ["", null];
      const indexOf = (key) => (this.shown.get(key)?.part.batch === batch ? this.shown.get(key).part.index : -1);
      return { label: "Marker", object: batch.object, count: batch.count, box: (index) => batch.box(index), indexOf,
        keyOf: (index) => entry(index)[0], describe: (index) => (entry(index)[1] ? describe(entry(index)[1].message) : []) };
    });
    return [...single.map(([key, { part, message }]) =>
      ({ label: `Marker ${key}`, object: part.object, describe: () => describe(message) })), ...batches];
  }

  // The markers of a hidden namespace are removed. After it is shown again, later messages add them.
  switchPart(name, isShown) {
    super.switchPart(name, isShown);
    if (isShown) return;
    for (const [key, { message }] of [...this.shown]) if (message.ns === name) this.remove(key);
  }

  // Places a marker: once, at its stamp, or repeatedly if it is locked to its frame.
  locate(key, entry) {
    const { message, part } = entry;
    const frame = withoutSlash(message.header.frame_id);
    try {
      part.place(this.poseAt(frame, message.frame_locked ? 0n : message.header.stamp));
      entry.isPlaced = !message.frame_locked;
      if (entry.isLost) this.dropStatus(key);
      entry.isLost = false;
    } catch (error) {
      if (!(error instanceof TransformError)) throw error;
      part.hide();
      entry.isLost = true;
      this.setStatus(key, "error", this.scene.whyNot(frame, error));
    }
  }

  // Returns the pose of a frame. The last one is kept, because many markers have the same frame and stamp.
  poseAt(frame, stamp) {
    const { last } = this;
    const { frames, fixedFrame } = this.scene;
    const isSame = last?.frame === frame && last.stamp === stamp && last.fixedFrame === fixedFrame;
    if (isSame && last.frames === frames && last.version === frames.version) return last.pose;
    const pose = this.scene.poseOf(frame, stamp);
    this.last = { frame, stamp, frames, version: frames.version, fixedFrame, pose };
    return pose;
  }

  frame() {
    const now = this.scene.now();
    for (const [key, entry] of this.shown) {
      if (entry.until !== null && now >= entry.until) {
        this.remove(key);
        this.scene.invalidate();
      } else if (!entry.isPlaced) this.locate(key, entry);
    }
  }

  detail(camera, height) {
    const { brightness } = this.scene.light;
    for (const batch of this.batches.all.values()) batch.arrange(camera, height, brightness, this.shown.size < FEW);
  }

  draw(marker, key) {
    if (marker.type === MESH) return this.mesh(marker, rgbOf(marker), key);
    const made = drawnMarker(marker);
    if (!made) this.setStatus(key, "error", `Unknown marker type: ${marker.type}.`);
    return made;
  }

  mesh(marker, rgb, key) {
    const group = new THREE.Group();
    const { color, mesh_use_embedded_materials: isOwn, scale } = marker;
    const keepsOwn = isOwn && color.r === 0 && color.g === 0 && color.b === 0 && color.a === 0;
    const hasOwn = ({ userData }) => isOwn && userData.isOwn;
    const tint = (own) => {
      const material = hasOwn(own) ? own.clone() : lit(keepsOwn ? [255, 255, 255] : rgb);
      if (!keepsOwn) Object.assign(material, blended(color.a));
      return material;
    };
    // rviz draws the marker's colour over the mesh's own materials, with an alpha of at most 0.5.
    const over = (own) => (hasOwn(own) ? lit(rgb, Math.min(0.5, color.a)) : lit(rgb, 0, { visible: false }));
    const { meshes } = this.scene;
    const layers = isOwn && !keepsOwn ? [tint, over] : [tint];
    Promise.all(layers.map((each) => meshes.mesh(marker.mesh_resource, each))).then((objects) => {
      group.add(...objects);
      this.scene.invalidate();
    }, (error) => this.setStatus(key, "error", `Could not load [${marker.mesh_resource}]: ${error.message}`));
    const scaled = new THREE.Group();
    group.scale.set(scale.x, scale.y, scale.z);
    scaled.add(group);
    return scaled;
  }
}

export class Marker extends Markers {
  begin() {
    super.begin();
    this.subscribe("Marker Topic", (marker) => this.take(marker), { isCounted: false });
    const topic = this.scene.topicName(this.get("Marker Topic"));
    if (!topic) return;
    this.stops.push(this.scene.subscribe(`${topic}_array`, this.queueSize(),
      ({ markers }) => markers.forEach((marker) => this.take(marker))));
  }
}

export class MarkerArray extends Markers {
  begin() {
    super.begin();
    this.subscribe("Marker Topic", ({ markers }) => markers.forEach((marker) => this.take(marker)), { isCounted: false });
  }
}
