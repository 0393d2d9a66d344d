// What all displays have in common: their properties, status texts, subscriptions, and messages that wait for transforms.

import * as THREE from "three";
import { TransformError } from "./frames.js";
import { clear, dispose, place } from "./shapes.js";
import { Properties, truth } from "./properties.js";
import { isStale } from "../stale.js";
import { topicOf } from "./topic_property.js";

const OLD_NS = 10000000000n; // messages this much older than the newest transform cannot be placed any more
const MAX_SENDERS = 20; // maximum number of senders that have their own status
const LONGEST_TEXT = 1000; // characters of a status
const REGULAR = 5; // number of messages from which a topic's interval is computed
export const LEVELS = ["ok", "warning", "error"];

export class Display {
  // `scene` is the Scene; `config` the display's map in the file.
  constructor(scene, schema, config) {
    this.scene = scene;
    this.config = config;
    this.properties = new Properties(schema, config);
    this.root = new THREE.Group();
    this.statuses = new Map(); // name to {level, text}
    this.stops = [];
    this.waiting = []; // messages without a transform
    this.received = 0;
    this.hasPlaced = false; // whether a message was placed
    this.sender = ""; // sender of the newest message
    this.arrivals = []; // times of the newest messages, in ms
    this.isOn = false;
    this.updatedAt = -Infinity; // in ms; see isDue
  }

  get name() {
    return this.config.Name ?? this.config.Class ?? "";
  }

  get isEnabled() {
    return truth(this.config.Enabled ?? this.config.Value, true);
  }

  get(...path) {
    return this.properties.get(...path);
  }

  setStatus(name, level, text) {
    text = text.length > LONGEST_TEXT ? `${text.slice(0, LONGEST_TEXT)} …` : text;
    const old = this.statuses.get(name);
    if (old?.level === level && old.text === text) return;
    this.statuses.set(name, { level, text });
    this.scene.noteStatus();
  }

  dropStatus(name) {
    if (this.statuses.delete(name)) this.scene.noteStatus();
  }

  // Returns the worst level of all statuses.
  get level() {
    return LEVELS[Math.max(0, ...[...this.statuses.values()].map(({ level }) => LEVELS.indexOf(level)))];
  }

  // -- life -------------------------------------------------------------------------------------------------------------

  turnOn() {
    if (this.isOn) return;
    this.isOn = true;
    this.arrivals = [];
    this.hasPlaced = false;
    this.scene.objects.add(this.root);
    this.begin();
  }

  turnOff() {
    if (!this.isOn) return;
    this.isOn = false;
    this.end();
    for (const stop of this.stops.splice(0)) stop();
    this.scene.objects.remove(this.root);
    this.reset();
    this.statuses.clear();
    this.scene.noteStatus();
  }

  // Called when the display is turned on: subscribe and draw here.
  begin() {}

  // Called when the display is turned off.
  end() {}

  // Called when a property has changed. Displays override it if they need not begin again.
  changed() {
    this.restart();
  }

  // Removes everything that was drawn from messages, because time jumped back or the fixed frame changed.
  reset() {
    clear(this.root);
    this.waiting = [];
  }

  // Begins again, because messages now come from another source.
  restart() {
    if (!this.isOn) return;
    this.turnOff();
    this.turnOn();
  }

  // Returns the names of the parts that can be switched (frames, links, namespaces), and the key of their map in the file.
  parts() {
    return { key: "", names: [] };
  }

  // Returns whether a part is shown. `fallback` applies to parts that the file does not mention.
  isPartShown(name, fallback) {
    const all = this.config[this.parts().key];
    const own = typeof all === "object" && all ? all[name] : undefined;
    return truth(typeof own === "object" && own ? own.Value : own, fallback);
  }

  // Shows or hides a part.
  switchPart(name, isShown) {
    const { key } = this.parts();
    if (typeof this.config[key] !== "object" || !this.config[key]) this.config[key] = {};
    const all = this.config[key];
    if (key === "Namespaces" || (key === "Visibility" && typeof all[name] !== "object")) all[name] = String(isShown);
    else all[name] = { ...(typeof all[name] === "object" ? all[name] : {}), Value: String(isShown) };
  }

  // Returns what the tool Select finds: {label, object, describe(index)}, where `describe` returns names and texts. If an
  // object draws `count` points of a `radius`, each is selected by its index.
  selectables() {
    return [];
  }

  // Returns a line for each thing that is still missing. A picture is complete when no display lacks anything.
  missing() {
    const topic = topicOf(this);
    if (topic && !this.received) return [`no message on [${topic}]`];
    return this.waiting.length && !this.hasPlaced ? [`no transform for the messages on [${topic}]`] : [];
  }

  // How much is drawn, such as "2,000 markers"; empty if it does not matter.
  load() {
    return "";
  }

  // Called before each picture.
  frame() {}

  // Called before each picture of `height` pixels, when the camera has been placed.
  detail(_camera, _height) {}

  // Returns whether the Update Interval has passed since the last update; if so, begins the next interval.
  isDue() {
    const now = performance.now();
    if (now - this.updatedAt < this.get("Update Interval") * 1000) return false;
    this.updatedAt = now;
    return true;
  }

  close() {
    this.turnOff();
    dispose(this.root);
  }

  // -- messages ---------------------------------------------------------------------------------------------------------

  // Subscribes to the topic in a property. `take(message, arrival)` is called with each decoded message. The status Topic shows
  // their number, unless `isCounted` is false.
  subscribe(property, take, { queue = 0, name = null, isCounted = true } = {}) {
    const topic = this.scene.topicName(name ?? this.get(property));
    this.received = 0;
    if (!topic) {
      this.setStatus("Topic", "error", "Error subscribing: Empty topic name");
      return;
    }
    this.setStatus("Topic", isCounted ? "warning" : "ok", isCounted ? "No messages received" : "OK");
    this.stops.push(this.scene.subscribe(topic, queue || Math.max(1, this.queueSize()), (message, arrival, sender) => {
      this.sender = sender;
      this.countMessage(isCounted);
      take(message, arrival);
    }, (text) => this.setStatus("Topic", "error", text), (count) =>
      this.setStatus("Queue", "warning", `${count} messages were dropped: more than the Queue Size arrived at once.`)));
  }

  queueSize() {
    return this.properties.find(["Queue Size"])[0] ? this.get("Queue Size") : 10;
  }

  countMessage(isCounted = true) {
    this.arrivals = [...this.arrivals.slice(1 - REGULAR), performance.now()];
    this.dropStatus("Age");
    this.received += 1;
    this.setStatus("Topic", "ok", isCounted ? `${this.received} messages received` : "OK");
  }

  // Reports a topic whose regular messages have ended. Not in simulated time, in which publishers may pause.
  noteAge() {
    if (this.arrivals.length < REGULAR || this.scene.simulatedNs !== null) return;
    const interval = (this.arrivals.at(-1) - this.arrivals[0]) / (REGULAR - 1);
    const age = performance.now() - this.arrivals.at(-1);
    if (!isStale(age / 1000, interval / 1000)) return;
    const sender = this.sender ? ` of [${this.sender}]` : "";
    this.setStatus("Age", "warning", `Stale: the last message${sender} is ${(age / 1000).toFixed(0)} s old; before, there was one every ` +
      `${(interval / 1000).toFixed(1)} s.`);
  }

  // Calls `put(message, pose)` as soon as the pose of the message's frame in the fixed frame is known at its stamp.
  // `until` returns the last stamp that must be known.
  whenPlaced(message, put, until = (each) => each.header.stamp) {
    this.waiting.push({ message, put, until, status: this.transformStatus() });
    const most = Math.max(1, this.queueSize());
    if (this.waiting.length > most) this.waiting.splice(0, this.waiting.length - most);
    this.placeWaiting();
  }

  // Returns the name of the status of the newest message's transform.
  transformStatus() {
    const isOfSender = (each) => each.startsWith("Transform [");
    const name = this.sender ? `Transform [sender=${this.sender}]` : "Transform";
    const others = [...this.statuses.keys()].filter(isOfSender);
    if (isOfSender(name) && !this.statuses.has(name) && others.length >= MAX_SENDERS) this.dropStatus(others[0]);
    return name;
  }

  // Tries the messages that wait for transforms.
  placeWaiting() {
    const left = [];
    for (const entry of this.waiting) {
      const { message, put, until, status } = entry;
      const frame = withoutSlash(message.header.frame_id);
      try {
        const pose = this.scene.poseOf(frame, message.header.stamp);
        if (until(message) !== message.header.stamp) this.scene.poseOf(frame, until(message));
        put(message, pose);
        this.hasPlaced = true;
        this.setStatus(status, "ok", "Transform OK");
        this.dropStatus("Link");
      } catch (error) {
        if (!(error instanceof TransformError)) {
          this.setStatus("Message", "error", error.message);
          continue;
        }
        if (this.isTooOld(frame, message.header.stamp)) {
          this.setStatus(status, "error",
            `Message removed because it is too old (frame=[${frame}], stamp=[${Number(message.header.stamp) / 1e9}])`);
          continue;
        }
        this.setStatus(status, "error", this.scene.whyNot(frame, error));
        this.explain(frame);
        left.push(entry);
      }
    }
    this.waiting = left;
  }

  // Shows in the status Link what keeps a frame from having a pose in the fixed frame.
  explain(frame) {
    const text = this.scene.explanation(frame);
    if (text) this.setStatus("Link", "warning", text);
    else this.dropStatus("Link");
  }

  isTooOld(frame, stamp) {
    if (!stamp || !this.scene.frames.has(frame)) return false;
    try {
      const newest = this.scene.frames.latestCommonTime(this.scene.fixedFrame, frame);
      return newest !== 0n && newest - stamp > OLD_NS;
    } catch {
      return false;
    }
  }

  // Moves the display to the newest pose of a frame. If the pose is unknown, the display stays where it is, and
  // `textOf(name, error)` returns the text of its status.
  follow(frame, textOf = (name, _error) => `No transform from [${name}] to [${this.scene.fixedFrame}]`) {
    const name = frame === "<Fixed Frame>" ? this.scene.fixedFrame : withoutSlash(frame);
    try {
      place(this.root, this.scene.poseOf(name, 0n));
      this.setStatus("Transform", "ok", "Transform OK");
      this.dropStatus("Link");
    } catch (error) {
      this.explain(name);
      this.setStatus("Transform", "error", error instanceof TransformError ? textOf(name, error) : error.message);
    }
  }
}

export const withoutSlash = (name) => (name.startsWith("/") ? name.slice(1) : name);
