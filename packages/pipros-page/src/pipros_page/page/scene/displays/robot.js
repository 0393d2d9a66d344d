// The robot of a URDF. Each link is at the newest transform of its frame; no joint states are used.

import * as THREE from "three";
import { Display } from "../display.js";
import { drawable, poseTexts } from "../pose.js";
import { truth } from "../properties.js";
import { BOX, CYLINDER, SPHERE, axes, blended, place } from "../shapes.js";

const RED = [1, 0, 0, 1]; // colour of shapes without a material

export class RobotModel extends Display {
  begin() {
    this.links = new Map(); // name to {group, visuals, collisions, hasPose}
    const name = this.get("Robot Description");
    this.stops.push(this.scene.context.watch("scene_robot", { name }, (data) => this.show(data),
      (text) => text && this.setStatus("URDF", "error", text)));
  }

  // A robot does not change when time jumps.
  reset() {
    this.waiting = [];
  }

  // The description is that of the running system, even while a bag is shown.
  restart() {}

  end() {
    super.reset();
  }

  changed() {
    if (this.properties.get("Robot Description") !== this.shownDescription) super.changed();
    else this.style();
    this.shownDescription = this.get("Robot Description");
  }

  parts() {
    return { key: "Links", names: [...this.links?.keys() ?? []] };
  }

  missing() {
    return this.links.size ? [] : [`no links in the parameter [${this.get("Robot Description")}]`];
  }

  selectables() {
    return [...this.links ?? []].map(([name, { group }]) =>
      ({ label: `Link ${name}`, object: group, describe: () => poseTexts([...group.position.toArray(), ...group.quaternion.toArray()]) }));
  }

  switchPart(name, isShown) {
    super.switchPart(name, isShown);
    this.style();
  }

  show(data) {
    this.shownDescription = this.get("Robot Description");
    super.reset();
    this.links.clear();
    if (data.error) {
      this.setStatus("URDF", "error", data.error);
      return;
    }
    this.setStatus("URDF", "ok", "URDF parsed OK");
    for (const link of data.links) {
      const entry = { group: new THREE.Group(), visuals: new THREE.Group(), collisions: new THREE.Group(), hasPose: null, materials: [] };
      entry.group.add(entry.visuals, entry.collisions);
      this.root.add(entry.group);
      this.links.set(link.name, entry);
      for (const shape of link.visuals) this.add(entry, entry.visuals, shape, link.name);
      for (const shape of link.collisions) this.add(entry, entry.collisions, shape, link.name);
    }
    this.style();
  }

  // Adds a shape to a link. Its material is kept in the link's list, with its own alpha.
  add(entry, parent, shape, link) {
    const remember = (material, alpha) => {
      entry.materials.push({ material, alpha, colour: material.color.clone() });
      return material;
    };
    const made = () => {
      const [r, g, b, a] = shape.color ?? (shape.texture ? [1, 1, 1, 1] : RED);
      const material = new THREE.MeshLambertMaterial({ color: new THREE.Color(r, g, b) });
      if (shape.texture) {
        this.scene.meshes.texture(shape.texture).then((texture) => {
          material.map = texture;
          material.needsUpdate = true;
          this.scene.invalidate();
        }, (error) => this.setStatus(`Link ${link}`, "error", `cannot load ${shape.texture}: ${error.message}`));
      }
      return remember(material, a);
    };
    const holder = new THREE.Group();
    place(holder, shape.origin.map(drawable));
    parent.add(holder);
    const size = shape.size.map((value) => drawable(value) || 1e-9);
    if (shape.kind !== "mesh") {
      const mesh = new THREE.Mesh({ box: BOX, sphere: SPHERE, cylinder: CYLINDER }[shape.kind], made());
      mesh.scale.set(...(shape.kind === "box" ? size : shape.kind === "sphere" ? size.map((radius) => 2 * radius)
        : [2 * size[0], 2 * size[1], size[2]]));
      holder.add(mesh);
      return;
    }
    let shared = null;
    this.scene.meshes.mesh(shape.uri, (own) => {
      if (own.userData.isOwn) {
        const copy = own.clone();
        return remember(copy, own.opacity);
      }
      shared ??= made();
      return shared;
    }).then((object) => {
      if (!this.links.has(link) || this.links.get(link) !== entry) return;
      const scaled = new THREE.Group();
      scaled.scale.set(...size);
      scaled.add(object);
      holder.add(scaled);
      entry.hasPose = null;
      this.style();
    }, (error) => {
      if (this.isOn) this.setStatus(`Link ${link}`, "error", `Could not load resource [${shape.uri}]: ${error.message}`);
    });
  }

  // Applies alpha and visibility.
  style() {
    for (const [name, entry] of this.links) {
      const own = this.config.Links?.[name];
      entry.isShown = this.isPartShown(name, this.get("Links", "All Links Enabled"));
      if (truth(own?.["Show Axes"], false) && !entry.axes) entry.group.add(entry.axes = axes(0.1, 0.01));
      entry.alpha = this.get("Alpha") * (Number.isFinite(Number(own?.Alpha)) ? Number(own.Alpha) : 1);
      entry.visuals.visible = this.get("Visual Enabled");
      entry.collisions.visible = this.get("Collision Enabled");
      this.paint(entry);
    }
    this.scene.invalidate();
  }

  frame() {
    if (!this.isDue()) return;
    const prefix = this.get("TF Prefix").replace(/\/$/, "");
    let lost = "";
    for (const [name, entry] of this.links) {
      const frame = prefix ? `${prefix}/${name}` : name;
      let pose = null;
      try {
        pose = this.scene.poseOf(frame, 0n);
      } catch {
        lost ||= frame; // the link stays where it was
      }
      if (pose) place(entry.group, pose);
      const hasPose = pose !== null;
      if (entry.hasPose !== hasPose) {
        entry.hasPose = hasPose;
        this.paint(entry);
        this.setStatus(name, hasPose ? "ok" : "error", hasPose ? "Transform OK"
          : `No transform from [${frame}] to [${this.scene.fixedFrame}]`);
      }
      entry.group.visible = entry.isShown !== false;
    }
    if (lost) this.explain(lost);
    else this.dropStatus("Link");
  }

  // Links without a transform are white, unlit and opaque.
  paint(entry) {
    const isWhite = entry.hasPose === false;
    for (const { material, alpha, colour } of entry.materials) {
      Object.assign(material, blended(isWhite ? 1 : entry.alpha * alpha));
      material.needsUpdate = true;
      material.color.copy(isWhite ? new THREE.Color(0, 0, 0) : colour);
      material.emissive.setRGB(...(isWhite ? [1, 1, 1] : [0, 0, 0]));
    }
  }
}
