// The objects selected with the tool Select. They are found by drawing each in the colour of a number, and listed with
// their properties.

import * as THREE from "three";
import { h, replace } from "../dom.js";
import { MARGIN } from "./picking.js";
import { pixelsOf } from "./pixels.js";
import { clear, thinLines } from "./shapes.js";

const MAX_LISTED = 100;
const REFRESH_MS = 500;
const COLOUR = [0, 255, 255];
const EDGES = [[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [5, 7], [7, 6], [6, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
const POINT_RADIUS = 0.03; // radius in metres of points whose size is in pixels

export class Selection {
  // The selection is refreshed until `signal` is aborted.
  constructor(scene, signal) {
    this.scene = scene;
    this.selected = new Map(); // key to {display, unit, index}; a unit is one of `display.selectables()`
    this.boxes = new THREE.Group();
    scene.world.add(this.boxes);
    this.list = h("div", {});
    this.title = h("b", {});
    this.element = h("div", { class: "scene-selection", role: "region", "aria-label": "Selection", hidden: true },
      h("div", { class: "scene-head" }, this.title, h("button", { onclick: () => this.clear() }, "Clear")), this.list);
    const timer = setInterval(() => this.selected.size && !scene.isHidden && this.refresh(), REFRESH_MS);
    signal.addEventListener("abort", () => clearInterval(timer));
  }

  clear() {
    this.selected.clear();
    this.refresh();
  }

  // Selects the objects visible in a rectangle of pixels. With `change` "add" or "remove", adds them to or removes them from the selection.
  pick([left, top, width, height], change = "") {
    if (!change) this.selected.clear();
    for (const found of this.visible(left, top, width, height)) {
      if (change === "remove") this.selected.delete(keyOf(found));
      else this.selected.set(keyOf(found), found);
    }
    this.refresh();
  }

  // Returns what is drawn in a rectangle: {display, unit, index}.
  visible(left, top, width, height) {
    const { view, canvas, tools } = this.scene;
    const units = [];
    const undo = [];
    let next = 1;
    const hide = (object) => {
      const was = object.visible;
      object.visible = false;
      undo.push(() => { object.visible = was; });
    };
    [tools, this.boxes, this.scene.focus].filter(Boolean).forEach(hide);
    for (const display of this.scene.all()) {
      if (!display.isOn || display.displays) continue;
      const own = display.selectables();
      if (!own.length) hide(display.root);
      for (const unit of own) {
        units.push({ display, unit, first: next });
        number(unit, next, undo, hide);
        next += unit.count ?? 1;
      }
    }
    const [wide, high] = [width + 2 * MARGIN, height + 2 * MARGIN];
    const target = new THREE.WebGLRenderTarget(wide, high);
    const numbers = new Set();
    view.camera.setViewOffset(canvas.clientWidth, canvas.clientHeight, left - MARGIN, top - MARGIN, wide, high);
    try {
      const pixels = pixelsOf(this.scene, view.camera, target, [MARGIN, MARGIN, width, height]);
      for (let at = 0; at < pixels.length; at += 4) numbers.add((pixels[at] << 16) | (pixels[at + 1] << 8) | pixels[at + 2]);
    } finally {
      view.camera.clearViewOffset();
      for (const each of undo.reverse()) each();
      target.dispose();
    }
    numbers.delete(0);
    return [...numbers].sort((one, other) => one - other).flatMap((value) => {
      const found = units.findLast(({ first }) => first <= value);
      const index = value - (found?.first ?? 0);
      return found && index < (found.unit.count ?? 1) ? [{ ...found, index }] : [];
    });
  }

  // Lists the selected objects that still exist.
  refresh() {
    const left = [...this.selected.values()].map((each) => this.renewed(each)).filter((each) => each !== null);
    this.selected = new Map(left.map((each) => [keyOf(each), each]));
    const shown = [...this.selected.values()].slice(0, MAX_LISTED);
    const more = this.selected.size - shown.length;
    this.element.hidden = !shown.length;
    replace(this.title, `${this.selected.size} selected`);
    const rows = shown.map(({ display, unit, index }) => h("div", { class: "scene-selected" },
      h("div", {}, `${display.name}: ${unit.label}${unit.keyOf ? ` ${unit.keyOf(index)}` : unit.count ? ` ${index}` : ""}`),
      unit.describe(index).map(([name, text]) => h("div", { class: "scene-field" }, h("span", {}, name), h("span", {}, text)))));
    replace(this.list, rows, more ? h("div", { class: "pale" }, `and ${more} more`) : null);
    clear(this.boxes);
    for (const each of shown) this.boxes.add(outline(boxOf(each)));
    this.scene.invalidate();
  }

  // Returns a selected object, or the object of a newer message that replaces it; null if it is gone. Clouds are not replaced.
  renewed(each) {
    const { display, unit } = each;
    if (unit.keyOf) return renewedPart(each);
    if (isWithin(unit.object, this.scene.objects)) return each;
    const other = display.isOn && !unit.count ? display.selectables().find(({ label }) => label === unit.label) : null;
    return other ? { ...each, unit: other } : null;
  }

  // Returns the middle of everything that is selected, or null.
  centre() {
    const all = new THREE.Box3();
    for (const each of this.selected.values()) all.union(boxOf(each));
    return all.isEmpty() ? null : all.getCenter(new THREE.Vector3());
  }
}

// Draws a unit in the colour of a number, or its points in the colours of successive numbers, and hides texts. Functions
// that undo this are added to `undo`.
function number({ object, count }, first, undo, hide) {
  object.traverse((each) => {
    const { material } = each;
    if (!material) return;
    if (each.isSprite) hide(each);
    else if (material.isShaderMaterial && !material.uniforms.number) hide(each);
    else if (material.isShaderMaterial) {
      const { blending, transparent, depthWrite } = material;
      const { number: own } = material.uniforms;
      Object.assign(material, { blending: THREE.NoBlending, transparent: false, depthWrite: true });
      own.value = count ? first : -first;
      undo.push(() => {
        Object.assign(material, { blending, transparent, depthWrite });
        own.value = 0;
      });
    } else {
      const plain = new THREE.MeshBasicMaterial({ color: first, side: THREE.DoubleSide });
      each.material = plain;
      undo.push(() => {
        each.material = material;
        plain.dispose();
      });
    }
  });
}

// Does the same as `renewed` for a part of an object that has a key, such as a marker in a batch.
function renewedPart(each) {
  const { display, unit, index } = each;
  each.key ??= unit.keyOf(index);
  if (!display.isOn) return null;
  for (const other of display.selectables()) {
    const at = other.indexOf?.(each.key) ?? -1;
    if (at >= 0) return { ...each, unit: other, index: at };
  }
  return null;
}

const keyOf = ({ unit, index }) => `${unit.object.uuid} ${index}`;

function isWithin(object, root) {
  for (let each = object; each; each = each.parent) if (each === root) return true;
  return false;
}

// Returns the box around a selected object, in the fixed frame.
function boxOf({ unit, index }) {
  if (unit.box) return unit.box(index).applyMatrix4(unit.object.matrixWorld);
  if (!unit.count) return new THREE.Box3().setFromObject(unit.object);
  const { geometry } = unit.object;
  const places = geometry.userData.places ?? geometry.getAttribute("position").array;
  const at = new THREE.Vector3().fromArray(places, 3 * index).applyMatrix4(unit.object.matrixWorld);
  return new THREE.Box3(at, at).expandByScalar(unit.radius || POINT_RADIUS);
}

function outline({ min, max }) {
  const corner = (n) => [n & 1 ? max.x : min.x, n & 2 ? max.y : min.y, n & 4 ? max.z : min.z];
  return thinLines(EDGES.flatMap(([from, to]) => [...corner(from), ...corner(to)]), COLOUR);
}
