// InteractiveMarkers: markers with controls that the mouse moves, and menus.

import * as THREE from "three";
import { ORIENTATION, controlOrientation, groupOrientation, turnAbout, worldOrientation } from "../control_poses.js";
import { markersOf, titleOf, unit } from "../default_controls.js";
import { Drag, MODE, rayAt } from "../dragging.js";
import { withoutSlash } from "../display.js";
import { TransformError } from "../frames.js";
import { InteractiveClient } from "../interactive_client.js";
import { feedbackOf } from "../interactive_feedback.js";
import { menuOf } from "../interactive_menu.js";
import { problemOf } from "../marker_checks.js";
import { composed, inverted, isFinitePose, normalized, poseOf } from "../pose.js";
import { axes, dispose, place } from "../shapes.js";
import { Markers } from "./markers.js";

const MOST = 2000; // maximum number of interactive markers in a display
const MAX_CONTROLS = 200; // maximum number of controls of one marker
const UPDATE = /\/update$/;
const QUEUE = 100;
const KEEP_ALIVE_MS = 250;
const EVENT = { keepAlive: 0, poseUpdate: 1, menuSelect: 2, buttonClick: 3, mouseDown: 4, mouseUp: 5 };
const GLOW = { hover: 0.3, active: 0.5 };

export class InteractiveMarkers extends Markers {
  begin() {
    super.begin();
    this.entries = new Map(); // "server/name" to the shown marker
    this.held = null; // {entry, control, drag, point, pixel, sentAt} while a button is down
    const topic = this.scene.topicName(this.get("Update Topic"));
    if (!topic || !UPDATE.test(topic)) {
      this.setStatus("Topic", "error", topic ? `Invalid topic name: ${topic}` : "Error subscribing: Empty topic name");
      return;
    }
    this.base = topic.replace(UPDATE, "");
    this.client = new InteractiveClient({
      add: (server, marker) => this.put(server, marker),
      move: (server, pose) => this.shift(`${server}/${pose.name}`, pose),
      erase: (server, name) => this.erase(`${server}/${name}`),
      clear: (server) => this.eraseOf(server),
      say: (level, text, server) => this.report(level, text, server),
      resubscribe: () => this.listenForStates(),
    });
    this.setStatus("General", "ok", "Waiting for messages.");
    this.stops.push(this.scene.subscribe(topic, QUEUE, (update) => this.client.update(update, performance.now()),
      (text) => this.setStatus("Topic", "error", text)));
    this.listenForStates();
    if (this.canAct) this.send(null);
  }

  // Shows the state of the connection to a server.
  report(level, text, server) {
    this.setStatus("General", "ok", "Receiving messages.");
    this.setStatus(server, level, text);
  }

  missing = () => (this.entries.size || !this.base ? [] : [`no interactive markers on [${this.base}]`]);

  listenForStates() {
    this.stopStates?.();
    this.stopStates = this.scene.subscribe(`${this.base}/update_full`, QUEUE, (state) => this.client.initialize(state, performance.now()),
      (text) => this.setStatus("Topic", "error", text));
  }

  end() {
    this.stopStates?.();
    this.stopStates = null;
    this.closeMenu();
    this.held = null;
  }

  // The server sends its state once. So after a change of the fixed frame or a jump in time, markers are only placed again.
  reset() {
    if (!this.isOn) {
      super.reset();
      this.entries = new Map();
    } else for (const entry of this.entries.values()) entry.isPlaced = false;
  }

  get canAct() {
    return this.scene.context.control;
  }

  // -- markers ------------------------------------------------------------------------------------------------------------

  put(server, message) {
    const key = `${server}/${message.name}`;
    this.erase(key);
    const pose = poseOf(message.pose);
    if (!isFinitePose(pose) || !Number.isFinite(message.scale)) {
      this.setStatus(message.name, "error", "Marker contains invalid floating point values (nans or infs)");
      return;
    }
    if (this.entries.size >= MOST) {
      this.setStatus("Markers", "error", `At most ${MOST} interactive markers are shown.`);
      return;
    }
    this.dropStatus(message.name);
    const [holder, body] = [new THREE.Group(), new THREE.Group()];
    const { header } = message;
    const entry = { message, key, server, header, pose: normalized(pose), holder, body, controls: [], isPlaced: false, pending: null };
    const scale = message.scale || 1;
    entry.holder.add(entry.body);
    this.root.add(entry.holder);
    this.entries.set(key, entry);
    for (const control of message.controls.slice(0, MAX_CONTROLS)) this.addControl(entry, control, scale);
    const extras = new THREE.Group();
    if (this.get("Show Descriptions") && message.description) this.addShape(extras, titleOf(message.description, scale), message.name);
    if (this.get("Show Axes")) extras.add(axes(scale, 0.05 * scale));
    entry.body.add(extras);
    this.arrange(entry);
    this.scene.invalidate();
  }

  addControl(entry, control, scale) {
    const group = new THREE.Group();
    const made = { ...control, orientation: unit(control.orientation), group, turned: 0 };
    const markers = markersOf({ ...control, orientation: made.orientation }, scale, this.get("Enable Transparency") ? 0.5 : 1);
    for (const marker of markers) this.addShape(group, marker, `${entry.message.name}/${control.name}`);
    group.traverse((each) => { each.userData.control = made; });
    made.entry = entry;
    entry.controls.push(made);
    entry.body.add(group);
  }

  addShape(parent, marker, name) {
    const problem = problemOf(marker);
    if (problem) {
      this.setStatus(name, "error", problem);
      return;
    }
    const object = this.draw(marker, name);
    if (!object) return;
    place(object, normalized(poseOf(marker.pose)));
    parent.add(object);
  }

  // Moves a marker; if it is being dragged, after the drag.
  shift(key, { header, pose }) {
    const entry = this.entries.get(key);
    if (!entry) return;
    if (this.held?.entry === entry) {
      entry.pending = { header, pose };
      return;
    }
    const next = poseOf(pose);
    if (!isFinitePose(next)) return;
    Object.assign(entry, { header, pose: normalized(next), isPlaced: false });
    this.arrange(entry);
  }

  erase(key) {
    const entry = this.entries.get(key);
    if (!entry) return;
    if (this.held?.entry === entry) this.held = null;
    this.entries.delete(key);
    this.root.remove(entry.holder);
    dispose(entry.holder);
    this.dropStatus(entry.message.name);
  }

  eraseOf(server) {
    for (const [key, entry] of [...this.entries]) if (entry.server === server) this.erase(key);
  }

  isLocked({ header }) {
    return header.stamp === 0n;
  }

  // Places a marker's frame: for each picture if its stamp is 0, otherwise once.
  arrange(entry) {
    const frame = withoutSlash(entry.header.frame_id) || this.scene.fixedFrame;
    const { name } = entry.message;
    if (!entry.isPlaced) {
      try {
        entry.frame = this.scene.poseOf(frame, entry.header.stamp);
        entry.isPlaced = !this.isLocked(entry);
        entry.holder.visible = true;
        if (this.isLocked(entry)) this.setStatus(name, "ok", `Locked to frame ${frame}`);
        else if (entry.isLost) this.dropStatus(name);
        entry.isLost = false;
      } catch (error) {
        if (!(error instanceof TransformError)) throw error;
        entry.holder.visible = false;
        entry.isLost = true;
        this.setStatus(name, "error", this.scene.whyNot(frame, error));
        return;
      }
    }
    place(entry.holder, entry.frame);
    entry.body.position.set(entry.pose[0], entry.pose[1], entry.pose[2]);
    const own = new THREE.Quaternion(entry.pose[3], entry.pose[4], entry.pose[5], entry.pose[6]);
    for (const control of entry.controls) {
      const { group } = control;
      group.visible = control.always_visible || this.scene.isInteracting;
      group.quaternion.copy(groupOrientation(control, own, this.scene.view.camera));
    }
    entry.body.children.at(-1).quaternion.copy(own);
  }

  frame() {
    this.client?.check(performance.now());
    for (const entry of this.entries.values()) this.arrange(entry);
    if (this.held?.drag && performance.now() - this.held.sentAt > KEEP_ALIVE_MS) this.feed(EVENT.keepAlive, this.held);
  }

  // -- mouse --------------------------------------------------------------------------------------------------------------

  // Returns the control at a pixel: {display, control, point, distance}, or null.
  find(pixel) {
    const { view, canvas } = this.scene;
    const caster = new THREE.Raycaster();
    caster.camera = view.camera;
    caster.ray.copy(rayAt(pixel, view.camera, canvas.clientWidth, canvas.clientHeight));
    this.root.updateMatrixWorld(true);
    const shown = [...this.entries.values()].filter(({ holder }) => holder.visible);
    const isActive = ({ group, interaction_mode: mode }) => group.visible && mode !== MODE.none;
    const active = shown.flatMap(({ controls }) => controls.filter(isActive));
    const [hit] = caster.intersectObjects(active.map(({ group }) => group), true);
    return hit ? { display: this, control: hit.object.userData.control, point: hit.point, distance: hit.distance } : null;
  }

  press({ control, point }, pixel, button) {
    const { entry } = control;
    this.closeMenu();
    if (button === 2) {
      if (entry.message.menu_entries.length) this.openMenu(control, point, pixel);
      return;
    }
    const mode = control.interaction_mode;
    const [position, orientation] = [entry.body.getWorldPosition(new THREE.Vector3()), worldOrientation(entry)];
    const axis = new THREE.Vector3(1, 0, 0).applyQuaternion(controlOrientation(control, this.scene.view.camera));
    const drag = mode >= MODE.moveAxis ? new Drag(mode, position, orientation, axis, point.clone(), pixel) : null;
    this.held = { entry, control, drag, point, pixel, sentAt: 0 };
    this.glow(control, GLOW.active);
    this.feed(EVENT.poseUpdate, this.held, point);
    this.feed(EVENT.mouseDown, this.held, point);
  }

  drag(pixel, keys) {
    const { held } = this;
    if (!held?.drag) return;
    const { view, canvas } = this.scene;
    held.pixel = pixel;
    if (!held.drag.move(pixel, view.camera, canvas.clientWidth, canvas.clientHeight, keys)) return;
    const { entry, drag, control } = held;
    const world = [...drag.position.toArray(), ...drag.orientation.toArray()];
    if (control.orientation_mode === ORIENTATION.fixed && control.interaction_mode === MODE.rotateAxis) {
      control.turned = turnAbout(drag.axis, drag.start.orientation, drag.orientation);
    }
    entry.pose = composed(inverted(entry.frame), world);
    this.arrange(entry);
    this.feed(EVENT.poseUpdate, held);
    this.scene.invalidate();
  }

  release(pixel) {
    const { held } = this;
    this.held = null;
    if (!held) return;
    const { control, entry } = held;
    this.glow(control, 0);
    const there = this.find(held.drag?.cursor(pixel) ?? pixel);
    const point = there?.point ?? null;
    const isClicked = there?.control === control;
    if (isClicked && control.interaction_mode === MODE.button) this.feed(EVENT.buttonClick, held, point);
    this.feed(EVENT.poseUpdate, held, point);
    this.feed(EVENT.mouseUp, held, point);
    if (isClicked && control.interaction_mode === MODE.menu) this.openMenu(control, point, pixel);
    if (entry.pending) this.shift(entry.key, entry.pending);
    entry.pending = null;
  }

  // Highlights the control under the mouse.
  hover(control) {
    if (this.hovered === control) return;
    if (this.hovered) this.glow(this.hovered, 0);
    this.hovered = control;
    if (control) this.glow(control, GLOW.hover);
  }

  glow({ group }, amount) {
    group.traverse(({ material }) => material?.emissive?.setScalar(amount));
    this.scene.invalidate();
  }

  // -- menus --------------------------------------------------------------------------------------------------------------

  openMenu(control, point, [x, y]) {
    const { entry } = control;
    const choose = (id) => {
      this.closeMenu();
      this.feed(EVENT.menuSelect, { entry, control }, point, id);
    };
    this.menu = menuOf(entry.message.menu_entries, this.canAct, choose);
    this.menu.style.left = `${x}px`;
    this.menu.style.top = `${y}px`;
    this.scene.canvas.after(this.menu);
    this.menu.querySelector("button:not([disabled])")?.focus();
  }

  closeMenu() {
    this.menu?.remove();
    this.menu = null;
  }

  // -- feedback -----------------------------------------------------------------------------------------------------------

  feed(event, { entry, control }, point = null, menuEntry = 0) {
    if (this.held) this.held.sentAt = performance.now();
    const frame = this.isLocked(entry) ? null : this.scene.fixedFrame;
    this.send({ client_id: this.name, ...feedbackOf(event, entry, control, frame, point, menuEntry) });
  }

  send(feedback) {
    this.scene.context.act("scene_feedback", { name: `${this.base}/feedback`, feedback }).catch((problem) =>
      this.setStatus("Feedback", "error", problem.message));
  }
}
