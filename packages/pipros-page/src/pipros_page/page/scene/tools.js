// The tools of rviz: buttons, keys, and what the mouse and fingers do in the picture.

import { h, replace } from "../dom.js";
import { Measuring } from "./measuring.js";
import { Picker } from "./picking.js";
import { headerOf, publishOnce } from "./publishing.js";
import { Rectangle } from "./rectangle.js";
import { Selection } from "./selection.js";
import { Properties, className } from "./properties.js";
import { arrow, clear, lit } from "./shapes.js";
import { ofYaw } from "./pose.js";
import { POSE, TOOLS, covarianceOf } from "./tool_kinds.js";
import { moveByMouse } from "./views.js";

const SAID_MS = 4000;
const DEFAULTS = Object.keys(TOOLS);

export class Tools {
  constructor(scene, canvas, status, context) {
    this.scene = scene;
    this.canvas = canvas;
    this.status = status;
    this.context = context;
    this.picker = new Picker(scene);
    this.element = h("span", { class: "scene-tools", role: "toolbar", "aria-label": "Tools" });
    this.confirm = h("span", { class: "scene-confirm", hidden: true });
    this.fingers = new Map(); // pointers that are down, by id
    this.mouse = [0, 0];
    this.selection = new Selection(scene, context.signal);
    this.rectangle = new Rectangle(canvas);
    this.grabbed = null; // the display whose control is held
    this.measuring = new Measuring(scene, status);
    this.current = "rviz/MoveCamera";
    this.first = this.current;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.release(event));
    canvas.addEventListener("pointercancel", (event) => this.cancel(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  // Shows the tools of the file.
  load() {
    const configs = Array.isArray(this.scene.config.Tools) ? this.scene.config.Tools : DEFAULTS.map((each) => ({ Class: each }));
    this.configs = new Map(configs.map((config) => [className(config.Class ?? ""), config]));
    const kinds = [...this.configs.keys()].filter((kind) => TOOLS[kind]);
    this.first = kinds[0] ?? "rviz/MoveCamera";
    this.buttons = new Map(kinds.map((kind) => {
      const { title, key, type } = TOOLS[kind];
      const disabled = Boolean(type) && !this.context.control;
      return [kind, h("button", { onclick: () => this.choose(kind), title: key ? `${title} (${key})` : title, disabled }, title)];
    }));
    replace(this.element, [...this.buttons.values()], this.confirm);
    this.choose(this.first);
  }

  choose(kind) {
    if (TOOLS[kind].type && !this.context.control) {
      this.say(`${TOOLS[kind].title} publishes messages; start the command with --control`);
      return;
    }
    this.current = kind;
    this.abandon(this.mouse);
    this.scene.isInteracting = kind === "rviz/Interact";
    this.measuring.points = [];
    this.confirm.hidden = true;
    for (const [each, button] of this.buttons) button.setAttribute("aria-pressed", String(each === kind));
    this.scene.invalidate();
  }

  say(text) {
    replace(this.status, text);
    clearTimeout(this.saying);
    if (text) this.saying = setTimeout(() => replace(this.status), SAID_MS);
  }

  // -- events -------------------------------------------------------------------------------------------------------------

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [Math.floor(event.clientX - box.left), Math.floor(event.clientY - box.top)];
  }

  press(event) {
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    const [x, y] = this.at(event);
    this.fingers.set(event.pointerId, { x, y });
    if (this.fingers.size > 1) {
      this.abandon([x, y]);
      return;
    }
    if (this.grab([x, y], event.button)) return;
    if (event.button === 2 && this.current === "rviz/Measure") this.measuring.add(null);
    if (event.button === 0) this.apply(x, y, event.altKey);
  }

  // Grabs the control of an interactive marker. Returns whether there is one.
  grab(pixel, button) {
    if (button === 1) return false;
    const found = this.controlAt(pixel);
    if (!found) return false;
    if (!this.context.control) {
      this.say("Moving markers publishes messages; start the command with --control");
      return false;
    }
    this.grabbed = found.display;
    found.display.press(found, pixel, button);
    return true;
  }

  letGo(pixel) {
    this.grabbed?.release(pixel);
    this.grabbed = null;
  }

  // Ends what the tool has begun, without an effect.
  abandon(pixel) {
    this.letGo(pixel);
    this.drag = null;
    this.rectangle.drop();
    clear(this.scene.tools);
  }

  // Returns the nearest control of an interactive marker at a pixel, or null.
  controlAt(pixel) {
    if (this.current !== "rviz/Interact") return null;
    const found = this.scene.all().flatMap((display) => (display.isOn && display.find ? (display.find(pixel) ?? []) : []));
    return found.sort((one, other) => one.distance - other.distance)[0] ?? null;
  }

  // Applies the tool to a pixel.
  apply(x, y, isCamera) {
    const kind = this.current;
    if (TOOLS[kind].colour) {
      const start = this.picker.ground(x, y);
      if (start) this.drag = { start, yaw: 0 };
    } else if (kind === "rviz/Select") {
      if (!isCamera) this.rectangle.begin([x, y]);
    } else if (["rviz/Measure", "rviz/PublishPoint", "rviz/FocusCamera"].includes(kind)) {
      const point = this.picker.point(x, y);
      if (!point) return;
      if (kind === "rviz/Measure") {
        clearTimeout(this.saying);
        this.measuring.add(point);
      }
      if (kind === "rviz/PublishPoint") this.publishPoint(point);
      if (kind === "rviz/FocusCamera") {
        this.scene.view.lookAt(point);
        this.choose(this.first);
      }
    }
  }

  move(event) {
    const finger = this.fingers.get(event.pointerId);
    const [x, y] = this.at(event);
    this.mouse = [x, y];
    if (!finger) {
      if (this.current === "rviz/PublishPoint" && event.buttons === 0) this.hover(x, y);
      if (this.current === "rviz/Interact") this.hoverControls([x, y]);
      return;
    }
    const [dx, dy] = [x - finger.x, y - finger.y];
    if (!dx && !dy) return;
    if (this.grabbed) {
      Object.assign(finger, { x, y });
      this.grabbed.drag([x, y], event);
      return;
    }
    const before = this.spread();
    Object.assign(finger, { x, y });
    if (this.fingers.size > 1) {
      const after = this.spread();
      if (before && after) this.scene.view.zoom(1 - before / after);
      moveByMouse(this.scene.view, this.canvas, { buttons: 4, shiftKey: false }, dx / this.fingers.size, dy / this.fingers.size);
      return;
    }
    if (this.drag) {
      this.aim(x, y);
      return;
    }
    if (this.rectangle.corner) {
      this.rectangle.extend([x, y]);
      return;
    }
    if (TOOLS[this.current].colour) return;
    moveByMouse(this.scene.view, this.canvas, event, dx, dy);
  }

  // Highlights the control under the mouse.
  hoverControls(point) {
    const found = this.controlAt(point);
    for (const display of this.scene.all()) {
      if (display.isOn && display.find) display.hover(found?.display === display ? found.control : null);
    }
  }

  release(event) {
    this.fingers.delete(event.pointerId);
    this.letGo(this.at(event));
    if (this.rectangle.corner) this.select(this.rectangle.end(this.at(event)), event);
    if (!this.drag) return;
    const { start, yaw } = this.drag;
    this.drag = null;
    const kind = this.current;
    if (event.pointerType === "touch") this.ask(kind, start, yaw);
    else this.send(kind, start, yaw);
  }

  cancel(event) {
    this.fingers.delete(event.pointerId);
    this.abandon(this.at(event));
    this.scene.invalidate();
  }

  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 40 : 1;
    if (event.shiftKey) this.scene.view.dolly(-(event.deltaY || event.deltaX) * lines * 0.01);
    else this.scene.view.zoom(Math.max(-0.9, Math.min(0.9, -event.deltaY * lines * 0.001)));
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const [x, y] = this.mouse;
    if (event.key === "z") this.scene.view.home();
    else if (event.key === "f") {
      const selected = this.current === "rviz/Select" ? this.selection.centre() : null;
      const point = selected ?? this.picker.point(x, y);
      if (point) this.scene.view.lookAt(point);
    } else if (event.key === "Escape") this.choose(this.first);
    else {
      const kind = [...this.buttons.keys()].find((each) => TOOLS[each].key === event.key);
      if (!kind) return;
      this.choose(kind === this.current ? this.first : kind);
    }
    event.preventDefault();
  }

  // Returns the distance between two fingers.
  spread() {
    const [a, b] = [...this.fingers.values()];
    return a && b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  }

  // -- poses and points ---------------------------------------------------------------------------------------------------

  aim(x, y) {
    const there = this.picker.ground(x, y);
    if (!there) return;
    const { start } = this.drag;
    if (there.distanceTo(start) > 0) this.drag.yaw = Math.atan2(there.y - start.y, there.x - start.x);
    this.preview(this.current, start, this.drag.yaw);
  }

  preview(kind, start, yaw) {
    clear(this.scene.tools);
    const shown = arrow(2, 0.2, 0.5, 0.35, lit(TOOLS[kind].colour));
    shown.position.copy(start);
    shown.rotation.z = yaw;
    this.scene.tools.add(shown);
    this.scene.invalidate();
  }

  // On a touch screen a pose is sent after a second tap, because fingers slip.
  ask(kind, start, yaw) {
    this.preview(kind, start, yaw);
    replace(this.confirm,
      h("button", { class: "primary", onclick: () => this.send(kind, start, yaw) }, `Send ${TOOLS[kind].title}`),
      h("button", { onclick: () => this.choose(kind) }, "Cancel"));
    this.confirm.hidden = false;
  }

  send(kind, start, yaw) {
    const [, , z, w] = ofYaw(yaw);
    const pose = { position: { x: start.x, y: start.y, z: 0 }, orientation: { x: 0, y: 0, z, w } };
    if (kind === "rviz/SetGoal") this.publish(kind, { pose });
    else {
      const covariance = covarianceOf(new Properties(POSE, this.configs.get(kind) ?? {}));
      this.publish(kind, { pose: { pose, covariance } });
    }
    this.choose(this.first);
    this.preview(kind, start, yaw);
    setTimeout(() => {
      clear(this.scene.tools);
      this.scene.invalidate();
    }, 1000);
  }

  publishPoint(point) {
    const kind = "rviz/PublishPoint";
    this.publish(kind, { point: { x: point.x, y: point.y, z: point.z } });
    if (new Properties(POSE, this.configs.get(kind) ?? {}).get("Single click")) this.choose(this.first);
  }

  publish(kind, content) {
    const { type, topic, title } = TOOLS[kind];
    const name = this.scene.topicName(new Properties(POSE, this.configs.get(kind) ?? {}).get("Topic") || topic);
    const say = (problem) => this.say(problem || `${title} published on ${name}`);
    publishOnce(this.context, { name, type }, { header: headerOf(this.scene), ...content }, say);
  }

  // -- looking ------------------------------------------------------------------------------------------------------------

  hover(x, y) {
    const point = this.picker.point(x, y);
    this.say(point ? `[${shown(point)}]` : "");
  }

  select(rectangle, { shiftKey, ctrlKey }) {
    this.selection.pick(rectangle, shiftKey ? "add" : ctrlKey ? "remove" : "");
    if (!this.selection.selected.size) this.say("Nothing is selected.");
  }
}

const shown = (point) => [point.x, point.y, point.z].map((value) => value.toFixed(3)).join(", ");
