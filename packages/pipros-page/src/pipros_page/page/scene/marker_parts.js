// What draws a marker: a separate object, or one of the shapes in a batch.

import * as THREE from "three";
import { BatchOfSolids } from "./batches_of_solids.js";
import { dispose, place } from "./shapes.js";
import { DETAILS } from "./solid_details.js";

export const SMALLEST = 1e-9; // metres: a size of 0 would make the matrix singular

// Returns the sizes of a solid. A negative size mirrors it, which changes no cube, sphere or cylinder.
export const sizesOf = ({ x, y, z }) => [x, y, z].map((size) => Math.abs(size) || SMALLEST);

// A separate object, below `root`.
export class OwnObject {
  constructor(root, object) {
    this.root = root;
    this.object = new THREE.Group();
    if (object) this.object.add(object);
    root.add(this.object);
  }

  // Places the frame of the marker.
  place(pose) {
    place(this.object, pose);
    this.object.visible = true;
  }

  hide() {
    this.object.visible = false;
  }

  remove() {
    this.root.remove(this.object);
    dispose(this.object);
  }
}

// Whether markers of a type are drawn in batches.
export const isSolid = (type) => Object.hasOwn(DETAILS, type);

// Reused for each of many markers.
const own = { position: new THREE.Vector3(), quaternion: new THREE.Quaternion(), scale: new THREE.Vector3(), matrix: new THREE.Matrix4() };

// A cube, sphere or cylinder in one of `batches`.
export class InBatch {
  constructor(batches, isTransparent, marker) {
    this.batches = batches;
    this.key = `${marker.type} ${isTransparent} ${marker.ns}`;
    this.batch = batches.of(this.key, DETAILS[marker.type], isTransparent);
    this.index = this.batch.add();
    this.isThere = true;
    this.local = new THREE.Matrix4();
    this.change(marker);
  }

  // Takes size and colour from a newer message. It is drawn with the next `place`.
  change({ scale, color, pose }) {
    const { position: p, orientation: q } = pose;
    own.quaternion.set(q.x, q.y, q.z, q.w).normalize(); // becomes the identity if all components are 0
    const [x, y, z] = sizesOf(scale);
    this.local.compose(own.position.set(p.x, p.y, p.z), own.quaternion, own.scale.set(x, y, z));
    this.color = color;
  }

  place(pose) {
    this.batch.set(this.index, own.matrix.multiplyMatrices(matrixOf(pose), this.local), this.color);
  }

  hide() {
    this.batch.hide(this.index);
  }

  remove() {
    if (!this.isThere) return;
    this.isThere = false;
    this.batch.remove(this.index);
    if (this.batch.isEmpty) this.batches.end(this.key);
  }
}

let last = { pose: null, matrix: new THREE.Matrix4() }; // many markers have the same frame

function matrixOf(pose) {
  if (last.pose !== pose) {
    const quaternion = new THREE.Quaternion(pose[3], pose[4], pose[5], pose[6]).normalize();
    const matrix = new THREE.Matrix4().compose(new THREE.Vector3(pose[0], pose[1], pose[2]), quaternion, new THREE.Vector3(1, 1, 1));
    last = { pose, matrix };
  }
  return last.matrix;
}

// The batches of a display, below `root`: one for each type, namespace and transparency.
export class Batches {
  constructor(root) {
    this.root = root;
    this.all = new Map(); // key to BatchOfSolids
  }

  of(key, levels, isTransparent) {
    const known = this.all.get(key);
    if (known) return known;
    const made = new BatchOfSolids(levels, isTransparent);
    this.all.set(key, made);
    this.root.add(made.object);
    return made;
  }

  end(key) {
    const batch = this.all.get(key);
    this.all.delete(key);
    this.root.remove(batch.object);
    batch.dispose();
  }

  clear() {
    for (const key of [...this.all.keys()]) this.end(key);
  }
}
