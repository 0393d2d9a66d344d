// All frames: axes, names, and arrows to the parents.

import * as THREE from "three";
import { Display } from "../display.js";
import { poseTexts } from "../pose.js";
import { arrowShape, axes, blended, clear, lit, place, textSprite } from "../shapes.js";

const MAX_DRAWN = 1000;

export class Tf extends Display {
  begin() {
    this.drawn = new Map(); // name to {group, line, label, axes, stamp, seen, shown, length, scale}
    this.wereAll = this.get("Frames", "All Enabled");
  }

  reset() {
    super.reset();
    this.drawn = new Map();
  }

  parts() {
    return { key: "Frames", names: this.scene.frames.names() };
  }

  selectables() {
    return [...this.drawn ?? []].map(([name, { group }]) =>
      ({ label: `Frame ${name}`, object: group, describe: () =>
        [["Parent", this.scene.frames.parent(name) ?? ""], ...poseTexts([...group.position.toArray(), ...group.quaternion.toArray()])] }));
  }

  // As in rviz, All Enabled only switches the frames that exist when it is changed.
  changed() {
    const isAll = this.get("Frames", "All Enabled");
    if (isAll !== this.wereAll) for (const name of this.parts().names) this.switchPart(name, isAll);
    super.changed();
  }

  pattern(property) {
    const text = this.get(property);
    try {
      return text ? new RegExp(text) : null;
    } catch {
      this.setStatus(property, "error", `${text} is not a regular expression`);
      return null;
    }
  }

  frame() {
    if (!this.isDue()) return;
    const { frames } = this.scene;
    const now = this.scene.now();
    const [scale, alpha, timeout] = [this.get("Marker Scale"), this.get("Marker Alpha"), this.get("Frame Timeout")];
    const names = frames.names().slice(0, MAX_DRAWN);
    const known = new Set(names);
    for (const [name, entry] of this.drawn) {
      if (known.has(name)) continue;
      clear(entry.group);
      clear(entry.line);
      this.root.remove(entry.group, entry.line);
      this.drawn.delete(name);
    }
    const filters = [this.pattern("Filter (whitelist)"), this.pattern("Filter (blacklist)")];
    for (const name of names) {
      if (!this.isPartShown(name, true) || !accepts(name, filters)) {
        const hidden = this.drawn.get(name);
        if (hidden) hidden.group.visible = hidden.line.visible = false;
        continue;
      }
      this.update(this.drawn.get(name) ?? this.draw(name, scale, alpha), name, now, { scale, alpha, timeout });
    }
  }

  // Draws a frame at its current pose, and shows its age.
  update(entry, name, now, { scale, alpha, timeout }) {
    const { frames, fixedFrame } = this.scene;
    const stamp = this.newestStamp(name, fixedFrame);
    if (entry.stamp !== stamp || stamp === 0n) {
      entry.stamp = stamp;
      entry.seen = now;
    }
    const age = Number(now - entry.seen) / 1e9;
    const fade = age <= timeout / 3 ? 0 : Math.min(1, (age - timeout / 3) / (timeout / 3));
    const rest = age <= (2 * timeout) / 3 ? 1 : Math.max(0, 1 - (age - (2 * timeout) / 3) / (timeout / 3));
    this.shade(entry, fade, rest * alpha);
    let pose = null;
    try {
      pose = this.scene.poseOf(name, 0n);
    } catch {
      this.setStatus(name, "warning", `No transform from [${name}] to frame [${fixedFrame}]`);
    }
    entry.group.visible = pose !== null && age < timeout;
    entry.line.visible = false;
    if (!pose) return;
    this.setStatus(name, "ok", "Transform OK");
    place(entry.group, pose);
    // The name does not turn with its frame.
    entry.label.visible = entry.group.visible && this.get("Show Names");
    entry.axes.visible = this.get("Show Axes");
    if (entry.group.visible && this.get("Show Arrows")) this.connect(entry, frames.parent(name), scale);
  }

  newestStamp(name, fixedFrame) {
    try {
      return this.scene.frames.latestCommonTime(fixedFrame, name);
    } catch {
      return 0n;
    }
  }

  draw(name, scale, alpha) {
    const group = new THREE.Group();
    const cross = axes(0.2 * scale, 0.02 * scale, alpha);
    const label = textSprite(name, 0.1 * scale, [255, 255, 255], alpha, [0.5, 1]);
    group.add(cross, label);
    const line = new THREE.Group();
    this.root.add(group, line);
    const entry = { group, line, label, axes: cross, stamp: null, seen: this.scene.now(), shown: "", length: -1 };
    this.drawn.set(name, entry);
    return entry;
  }

  // Draws an old frame in grey, and then fades it out.
  shade(entry, fade, alpha) {
    const shown = `${fade.toFixed(2)} ${alpha.toFixed(2)}`;
    if (entry.shown === shown) return;
    entry.shown = shown;
    const { material } = entry.axes.children[0];
    material.userData.fade.value = fade;
    Object.assign(material, blended(alpha));
    Object.assign(entry.label.material, blended(alpha), { transparent: true });
  }

  connect(entry, parent, scale) {
    if (!parent) return;
    let from;
    try {
      from = this.scene.poseOf(parent, 0n);
    } catch {
      return;
    }
    const here = entry.group.position;
    const there = new THREE.Vector3(from[0], from[1], from[2]);
    const along = there.clone().sub(here);
    const distance = along.length();
    if (distance <= 0.001) return;
    if (Math.abs(entry.length - distance) > 1e-4 * distance || entry.scale !== scale) {
      clear(entry.line);
      const head = distance < 0.1 * scale ? 0.1 * scale * distance : 0.1 * scale;
      const shape = arrowShape(distance - head, 0.01 * scale, head, 0.04 * scale, [0.8, 0.8, 0.3], [1, 0.1, 0.6]);
      entry.line.add(new THREE.Mesh(shape, lit([255, 255, 255], 1, { vertexColors: true })));
      entry.length = distance;
      entry.scale = scale;
    }
    entry.line.visible = true;
    entry.line.position.copy(here);
    entry.line.quaternion.setFromUnitVectors(new THREE.Vector3(1, 0, 0), along.normalize());
  }
}

/** @type {(name: string, filters: RegExp[]) => boolean} */
const accepts = (name, [white, black]) => (!white || white.test(name)) && !(black && black.test(name));
