// The scene: transforms, displays and the picture. It draws when something has changed, and every 0.5 s, at most
// at the file's frame rate.

import * as THREE from "three";
import { playback } from "../bags/playback.js";
import { live } from "../live.js";
import { Frames } from "./frames.js";
import { Headlight } from "./headlight.js";
import { Meshes, resourceOf } from "./meshes.js";
import { Pacing } from "./pacing.js";
import { poseOf } from "./pose.js";
import { Properties } from "./properties.js";
import { GLOBAL } from "./schema.js";
import { colourOf } from "./shapes.js";
import { SlowDisplay } from "./slow_display.js";
import { Subscription } from "./subscription.js";
import { viewOf } from "./views.js";
import { makeDisplay } from "./registry.js";
import { explanation, fixedFrameStatus, otherRoots, whyNot } from "./transform_texts.js";

THREE.ColorManagement.enabled = false;

const TF_QUEUE = 1000;
const SETTLING_MS = 5000; // how long late messages are recognised after time has jumped back
const AHEAD_NS = 1000000000n; // a late message is more than this ahead of simulated time

export class Scene {
  // `context` is the tab's; `onStatus()` is called when a status has changed.
  constructor(context, canvas, onStatus) {
    this.context = context;
    this.canvas = canvas;
    this.onStatus = onStatus;
    this.frames = new Frames();
    this.meshes = new Meshes(resourceOf);
    this.displays = [];
    this.objects = new THREE.Group();
    this.tools = new THREE.Group(); // what tools draw
    this.world = new THREE.Scene();
    this.world.add(this.objects, this.tools);
    this.light = new Headlight(this.world);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: live.isSmooth, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.sortObjects = true;
    this.config = {};
    this.options = new Properties(GLOBAL, {});
    this.simulatedNs = null; // the newest /clock, with simulated time
    this.stops = [];
    this.isDirty = true;
    this.isHidden = true;
    this.last = { time: 0, version: -1 };
    this.figures = { pictures: 0, ms: 0, bytes: 0 };
    this.slow = new SlowDisplay(this);
    this.isLost = false;
    this.pacing = new Pacing(this.renderer.getContext());
    this.settledAt = 0;
    this.frameProblem = ""; // why the newest refused transform was refused
    this.hasNewClouds = false; // whether the points must be divided again
    this.mostPoints = innerWidth < 700 ? 50000 : 200000; // maximum number of points of all clouds together
    this.isInteracting = false; // whether the tool Interact is chosen
    /** @type {HTMLElement | null} */
    this.images = null; // where displays show images
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.isLost = true;
      this.pacing.forget();
      this.onStatus();
    });
    context.onSource(() => this.restart());
    canvas.addEventListener("webglcontextrestored", () => {
      this.isLost = false;
      for (const display of this.all()) display.changed();
      this.invalidate();
    });
  }

  // -- life -------------------------------------------------------------------------------------------------------------

  // Shows a configuration: the map of a whole file.
  load(config, fixedFrame, isSimulated) {
    for (const display of this.displays) display.close();
    for (const stop of this.stops.splice(0)) stop();
    this.file = config;
    this.config = config["Visualization Manager"] ?? (config["Visualization Manager"] = {});
    const options = this.config["Global Options"] ?? (this.config["Global Options"] = {});
    this.options = new Properties(GLOBAL, options);
    if (fixedFrame) this.options.set(["Fixed Frame"], fixedFrame);
    const views = this.config.Views ?? (this.config.Views = {});
    if (typeof views.Current !== "object") views.Current = { Class: "rviz/Orbit", Name: "Current View" };
    this.setView(views.Current);
    if (!Array.isArray(this.config.Displays)) this.config.Displays = [];
    this.frames = new Frames();
    this.isSimulated = isSimulated;
    this.stops.push(this.subscribe("/tf", TF_QUEUE, (message, _, sender) => this.addTransforms(message, false, sender)));
    this.stops.push(this.subscribe("/tf_static", TF_QUEUE, (message, _, sender) => this.addTransforms(message, true, sender)));
    this.followClock();
    this.displays = this.config.Displays.map((each) => makeDisplay(this, each));
    for (const display of this.displays) if (display.isEnabled) display.turnOn();
    this.invalidate();
  }

  // Returns all displays, including those in groups.
  all() {
    const found = [];
    const visit = (display) => {
      found.push(display);
      display.displays?.forEach(visit);
    };
    this.displays.forEach(visit);
    return found;
  }

  setView(config) {
    this.view = viewOf(config, this);
    this.config.Views.Current = config;
    this.invalidate();
  }

  get fixedFrame() {
    return this.options.get("Fixed Frame");
  }

  // Removes everything that messages created: for another fixed frame, after a jump in time, and for the
  // button Reset.
  reset() {
    this.frameProblem = "";
    for (const display of this.all()) display.reset();
    this.invalidate();
  }

  // Removes everything that came from messages, because a bag was opened or closed, or its playback has jumped.
  restart() {
    this.frames = new Frames();
    this.frameProblem = "";
    this.followClock();
    for (const display of this.all()) display.restart();
    this.invalidate();
  }

  close() {
    for (const display of this.displays) display.close();
    for (const stop of this.stops) stop();
    this.stopClock?.();
    this.renderer.dispose();
  }

  // -- time and transforms ------------------------------------------------------------------------------------------------

  // Follows `/clock` if time is simulated or a bag is open.
  followClock() {
    const isFollowing = Boolean(this.isSimulated || playback.bag);
    this.simulatedNs = isFollowing ? 0n : null;
    this.stopClock?.();
    this.stopClock = isFollowing ? this.subscribe("/clock", 1, ({ clock }) => this.setClock(clock)) : null;
  }

  now() {
    return this.simulatedNs ?? BigInt(Math.round(Date.now() * 1e3)) * 1000n;
  }

  setClock(clock) {
    if (clock < this.simulatedNs) {
      this.settledAt = performance.now() + SETTLING_MS;
      this.frames.clear();
      this.reset();
    }
    this.simulatedNs = clock;
  }

  // Returns whether a message is from before a jump back in time, and arrived after the jump.
  isLate({ header }) {
    return this.simulatedNs !== null && performance.now() < this.settledAt && header?.stamp > this.simulatedNs + AHEAD_NS;
  }

  addTransforms({ transforms }, isStatic, sender = "") {
    for (const { header, child_frame_id: child, transform } of transforms) {
      const pose = poseOf(transform);
      const problem = this.frames.problemOf(header.frame_id, child, header.stamp, pose);
      if (problem) this.frameProblem = `The transform from [${child}] to [${header.frame_id}] sent by [${sender}] is ignored: ${problem}`;
      else this.frames.insert(header.frame_id, child, header.stamp, pose, sender, isStatic);
    }
  }

  // Returns the pose of a frame in the fixed frame. Throws a TransformError.
  poseOf(frame, stamp) {
    return this.frames.lookup(this.fixedFrame, frame, stamp);
  }

  // Returns why a frame has no pose in the fixed frame: rviz's text for a TransformError, and what else is known.
  whyNot(frame, error) {
    return whyNot(this.frames, this.fixedFrame, frame, error);
  }

  explanation(frame) {
    return explanation(this.frames, this.fixedFrame, frame, this.now());
  }

  fixedFrameStatus() {
    return fixedFrameStatus(this.frames, this.fixedFrame, this.frameProblem);
  }

  otherRoots() {
    return otherRoots(this.frames, this.fixedFrame);
  }

  // -- data ---------------------------------------------------------------------------------------------------------------

  topicName(text) {
    return !text || text.startsWith("/") ? text : `/${text}`;
  }

  // Calls `take(message, arrival, sender)` with each message of a topic, decoded. Returns a function that unsubscribes.
  // `onLost(count)` gets the number of messages dropped because this browser was too slow.
  subscribe(name, queue, take, onError = (_text) => {}, onLost = (_count) => {}) {
    return new Subscription(this, take, onError, onLost).begin(name, queue);
  }

  // Returns a line for each thing that is still missing.
  missing() {
    const shown = this.all().filter((display) => display.isOn && !display.displays);
    return [...shown.flatMap((display) => display.missing().map((text) => `${display.name}: ${text}`)),
      ...[...this.meshes.missing].map(([uri, text]) => `mesh [${uri}]: ${text}`)];
  }

  // Divides the points of this viewer among its clouds.
  sharePoints() {
    this.hasNewClouds = false;
    const clouds = this.all().filter((display) => display.isOn && display.takeShare);
    for (const each of clouds) each.takeShare(Math.max(1, Math.floor(this.mostPoints / clouds.length)));
  }

  // -- pictures -----------------------------------------------------------------------------------------------------------

  invalidate() {
    this.isDirty = true;
  }

  noteStatus() {
    this.hasNewStatus = true;
  }

  show() {
    if (!this.isHidden) return;
    this.isHidden = false;
    requestAnimationFrame((time) => this.tick(time));
  }

  hide() {
    this.isHidden = true;
  }

  tick(time) {
    if (this.isHidden) return;
    requestAnimationFrame((next) => this.tick(next));
    const interval = 1000 / Math.max(1, this.options.get("Frame Rate"));
    const elapsed = time - this.last.time;
    const isNew = this.isDirty || this.frames.version !== this.last.version || elapsed > 500;
    const isDue = isNew && elapsed >= interval - 2;
    this.pacing.note(time);
    if (this.slow.isLooking || (isDue && !this.pacing.isReady(time))) return;
    this.slow.note(time, isDue);
    if (!isDue || this.slow.isLooking) return;
    this.last = { time, version: this.frames.version };
    this.isDirty = false;
    this.draw();
    this.pacing.drawn(time);
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height || this.isLost || !this.view) return;
    const begin = performance.now();
    if (this.hasNewClouds) this.sharePoints();
    for (const display of this.all()) {
      if (!display.isOn) continue;
      try {
        if (display.waiting.length) display.placeWaiting();
        display.frame();
        display.noteAge();
      } catch (error) {
        display.setStatus("Display", "error", error.message);
      }
    }
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== width || size.y !== height) {
      this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
      this.renderer.setSize(width, height, false);
    }
    this.view.update(width, height);
    const { camera } = this.view;
    this.light.aim(camera, this.options.get("Default Light"));
    for (const display of this.all()) if (display.isOn) display.detail(camera, height);
    this.renderer.setClearColor(colourOf(this.options.get("Background Color")));
    this.renderer.render(this.world, camera);
    this.figures.pictures += 1;
    this.figures.ms = performance.now() - begin;
    if (this.hasNewStatus) {
      this.hasNewStatus = false;
      this.onStatus();
    }
  }
}
