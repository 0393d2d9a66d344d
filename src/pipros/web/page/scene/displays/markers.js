// visualization_msgs/Marker and MarkerArray.

import * as THREE from "three";
import { Display, withoutSlash } from "../display.js";
import { TransformError } from "../frames.js";
import { problemOf, warningOf } from "../marker_checks.js";
import { points } from "../points.js";
import { normalized, poseOf, poseTexts } from "../pose.js";
import { BOX, COARSE_SPHERE, CYLINDER, SPHERE, arrow, blended, colourOf, dispose, lit,
  place, segments, textSprite, unlit, wideLines } from "../shapes.js";

const [ADD, DELETE, DELETE_ALL] = [0, 2, 3];
const MAX_MARKERS = 20000;
const solids = [BOX, SPHERE, CYLINDER].map((shape) => (marker, rgb) => solid(shape, marker, rgb));
const TYPES = [null, ...solids, strip, list, cubes, spheres, squares, label, null, triangles];
const [ARROW, MESH] = [0, 10];
const [SPHERE_TYPE, SOLIDS] = [2, [1, 2, 3]]; // and cubes and cylinders
const FEW = 100; // markers; beyond them, spheres have fewer triangles

export class Markers extends Display {
  begin() {
    this.shown = new Map(); // "namespace/id" to {holder, message, until, stamp}
    this.namespaces = new Map(); // name to number of markers
  }

  reset() {
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
      this.setStatus("Markers", "error", `More than ${MAX_MARKERS} markers are not shown.`);
      return;
    }
    if (this.update(key, marker)) return;
    this.remove(key, false);
    const holder = new THREE.Group();
    const object = this.draw(marker, key);
    if (object) {
      place(object, normalized(poseOf(marker.pose)));
      holder.add(object);
    }
    const entry = { holder, sender: this.sender, message: marker, until: this.endOf(marker), isPlaced: false };
    this.shown.set(key, entry);
    this.root.add(holder);
    this.locate(key, entry);
  }

  // Changes a cube, sphere or cylinder to a newer message of the same type. Returns whether it did.
  update(key, marker) {
    const entry = this.shown.get(key);
    if (!entry || entry.message.type !== marker.type || !SOLIDS.includes(marker.type)) return false;
    const [object] = entry.holder.children;
    const [mesh] = object.children;
    resize(mesh, marker);
    mesh.material.color.copy(colourOf(rgbOf(marker)));
    Object.assign(mesh.material, blended(marker.color.a));
    place(object, normalized(poseOf(marker.pose)));
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
    this.root.remove(entry.holder);
    dispose(entry.holder);
    if (isGone) this.dropStatus(key);
  }

  isShown(namespace) {
    if (!this.namespaces.has(namespace) && this.namespaces.size < 1000) this.namespaces.set(namespace, 0);
    return this.isPartShown(namespace, true);
  }

  parts() {
    return { key: "Namespaces", names: [...this.namespaces?.keys() ?? []] };
  }

  selectables() {
    const describe = ({ header, pose }) => [["Frame", header.frame_id], ...poseTexts(poseOf(pose))];
    const all = [...this.shown ?? []];
    return all.map(([key, { holder, message }]) => ({ label: `Marker ${key}`, object: holder, describe: () => describe(message) }));
  }

  // The markers of a hidden namespace are removed. Later messages show them again.
  switchPart(name, isShown) {
    super.switchPart(name, isShown);
    if (isShown) return;
    for (const [key, { message }] of [...this.shown]) if (message.ns === name) this.remove(key);
  }

  // Places a marker: once, at its stamp, or repeatedly if it is locked to its frame.
  locate(key, entry) {
    const { message, holder } = entry;
    const frame = withoutSlash(message.header.frame_id);
    try {
      place(holder, this.scene.poseOf(frame, message.frame_locked ? 0n : message.header.stamp));
      entry.isPlaced = !message.frame_locked;
      holder.visible = true;
      if (entry.isLost) this.dropStatus(key);
      entry.isLost = false;
    } catch (error) {
      if (!(error instanceof TransformError)) throw error;
      holder.visible = false;
      entry.isLost = true;
      this.setStatus(key, "error", this.scene.whyNot(frame, error));
    }
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

  draw(marker, key) {
    const rgb = rgbOf(marker);
    if (marker.type === ARROW) return arrowOf(marker, rgb);
    if (marker.type === MESH) return this.mesh(marker, rgb, key);
    const make = TYPES[marker.type];
    if (marker.type === SPHERE_TYPE && this.shown.size >= FEW) return solid(COARSE_SPHERE, marker, rgb);
    if (make) return make(marker, rgb);
    this.setStatus(key, "error", `Unknown marker type: ${marker.type}.`);
    return null;
  }

  mesh(marker, rgb, key) {
    const group = new THREE.Group();
    const { color, mesh_use_embedded_materials: isOwn, scale } = marker;
    const keepsOwn = isOwn && color.r === 0 && color.g === 0 && color.b === 0 && color.a === 0;
    const tint = (own) => {
      const material = isOwn && own.userData.isOwn ? own.clone() : lit(keepsOwn ? [255, 255, 255] : rgb);
      if (!keepsOwn) Object.assign(material, blended(color.a));
      return material;
    };
    this.scene.meshes.mesh(marker.mesh_resource, tint).then((object) => {
      group.add(object);
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

// -- shapes --------------------------------------------------------------------------------------------------------------

function arrowOf({ scale, color, points: places }, rgb) {
  const material = lit(rgb, color.a);
  const group = new THREE.Group();
  if (places.length < 2) {
    group.add(arrow(0.77 * scale.x, scale.y, 0.23 * scale.x, 2 * scale.y, material));
    group.scale.z = scale.y ? scale.z / scale.y : 1;
    const turned = new THREE.Group();
    turned.add(group);
    return turned;
  }
  const [from, to] = places.map(({ x, y, z }) => new THREE.Vector3(x, y, z));
  const along = to.clone().sub(from);
  const length = along.length();
  const head = Math.min(length, scale.z || 0.23 * length);
  const shape = arrow(length - head, scale.x, head, scale.y, material);
  shape.position.copy(from);
  if (length) shape.quaternion.setFromUnitVectors(new THREE.Vector3(1, 0, 0), along.normalize());
  group.add(shape);
  return group;
}

const rgbOf = ({ color }) => [color.r, color.g, color.b].map((part) => part * 255);
const resize = (mesh, { scale }) => mesh.scale.set(scale.x || 1e-9, scale.y || 1e-9, scale.z || 1e-9);

function solid(geometry, marker, rgb) {
  const mesh = new THREE.Mesh(geometry, lit(rgb, marker.color.a));
  resize(mesh, marker);
  const group = new THREE.Group();
  group.add(mesh);
  return group;
}

const coordinates = (places) => places.flatMap(({ x, y, z }) => [x, y, z]);

// Returns RGBA (0 to 1) of each point: the points' own colours, if there is one for each.
function tintsOf({ color, colors, points: places }) {
  const isEach = colors.length > 0 && colors.length >= places.length;
  const own = isEach ? colors.slice(0, places.length) : [color];
  return { isEach, tints: own.flatMap(({ r, g, b, a }) => [r, g, b, a]) };
}

function strip(marker) {
  const { isEach, tints } = tintsOf(marker);
  const doubled = [];
  if (isEach) for (let i = 0; i + 8 <= tints.length; i += 4) doubled.push(...tints.slice(i, i + 8));
  return wideLines(segments(coordinates(marker.points)), marker.scale.x, isEach ? doubled : tints, hasAlpha(isEach, tints));
}

function list(marker) {
  const { isEach, tints } = tintsOf(marker);
  return wideLines(coordinates(marker.points), marker.scale.x, tints, hasAlpha(isEach, tints));
}

const hasAlpha = (isEach, tints) => (isEach ? tints.some((value, i) => i % 4 === 3 && value < 0.9998) : tints[3] < 0.9998);

function many(style, marker, size) {
  const { isEach, tints } = tintsOf(marker);
  const count = marker.points.length;
  const byte = (value) => Math.min(255, Math.max(0, Math.round(value * 255)));
  const bytes = Uint8Array.from({ length: count * 4 }, (_, i) => byte(tints[isEach ? i : i % 4]));
  return points(style, Float32Array.from(coordinates(marker.points)), bytes, size, 1, hasAlpha(isEach, tints));
}

function cubes(marker) {
  return many("Boxes", marker, [marker.scale.x, marker.scale.y, marker.scale.z]);
}

function spheres(marker) {
  return many("Spheres", marker, marker.scale.x);
}

function squares(marker) {
  return many("Squares", marker, marker.scale.x);
}

function label({ text, scale, color }, rgb) {
  const group = new THREE.Group();
  if (text.trim()) group.add(textSprite(text, scale.z, rgb, color.a));
  return group;
}

function triangles(marker, rgb) {
  const { points: places, colors, color, scale } = marker;
  const count = Math.floor(places.length / 3) * 3;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(coordinates(places.slice(0, count))), 3));
  geometry.computeVertexNormals();
  const perTriangle = colors.length > 0 && colors.length === count / 3;
  const isColoured = perTriangle || (colors.length > 0 && colors.length >= count);
  if (isColoured) {
    const tints = Float32Array.from({ length: count * 4 }, (_, i) => {
      const { r, g, b, a } = colors[perTriangle ? Math.floor(i / 12) : i >> 2];
      return [r, g, b, a][i % 4];
    });
    geometry.setAttribute("color", new THREE.BufferAttribute(tints, 4));
  }
  const group = new THREE.Group();
  const add = (material) => {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.scale.set(scale.x || 1e-9, scale.y || 1e-9, scale.z || 1e-9);
    group.add(mesh);
  };
  // The light reaches the front only; the back of triangles without colours is black.
  if (isColoured) add(unlit([255, 255, 255], color.a, { side: THREE.DoubleSide, vertexColors: true }));
  else {
    add(lit(rgb, color.a));
    add(unlit([0, 0, 0], color.a, { side: THREE.BackSide }));
  }
  return group;
}

