// The scene: transforms, displays and the picture. It draws when something has changed, at most at the file's frame rate.

import * as THREE from "three";
import { live } from "../live.js";
import { Frames } from "./frames.js";
import { decoderOf } from "./layout.js";
import { Meshes } from "./meshes.js";
import { poseOf } from "./pose.js";
import { GLOBAL, Properties } from "./properties.js";
import { colourOf } from "./shapes.js";
import { viewOf } from "./views.js";
import { makeDisplay } from "./registry.js";

THREE.ColorManagement.enabled = false;

const TF_QUEUE = 1000;
const LINK_AGE_S = 2;
const isLocal = ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);

export class Scene {
  // `context` is the tab's; `onStatus()` is called when a status has changed.
  constructor(context, canvas, onStatus) {
    this.context = context;
    this.canvas = canvas;
    this.onStatus = onStatus;
    this.frames = new Frames();
    this.meshes = new Meshes((uri) => this.resource(uri));
    this.displays = [];
    this.objects = new THREE.Group();
    this.tools = new THREE.Group(); // what tools draw
    this.world = new THREE.Scene();
    this.world.add(this.objects, this.tools);
    this.light = new THREE.DirectionalLight(0xffffff, Math.PI);
    this.world.add(this.light, this.light.target);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.sortObjects = true;
    this.config = {};
    this.options = new Properties(GLOBAL, {});
    this.simulatedNs = null; // the newest /clock, with simulated time
    this.stops = [];
    this.isDirty = true;
    this.isHidden = true;
    this.last = { time: 0, version: -1 };
    this.figures = { pictures: 0, ms: 0 };
    this.isLost = false;
    this.isInteracting = false; // whether the tool Interact is chosen
    /** @type {HTMLElement | null} */
    this.images = null; // where displays show images
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.isLost = true;
      this.onStatus();
    });
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
    this.stops.push(this.subscribe("/tf", TF_QUEUE, (message) => this.addTransforms(message, false)));
    this.stops.push(this.subscribe("/tf_static", TF_QUEUE, (message) => this.addTransforms(message, true)));
    this.simulatedNs = isSimulated ? 0n : null;
    if (isSimulated) this.stops.push(this.subscribe("/clock", 1, ({ clock }) => this.setClock(clock)));
    this.displays = this.config.Displays.map((each) => makeDisplay(this, each));
    for (const display of this.displays) if (display.isEnabled) display.turnOn();
    this.invalidate();
  }

  // Returns all displays, with those in groups.
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

  setFixedFrame(name) {
    this.options.set(["Fixed Frame"], name);
    this.reset();
  }

  // Removes everything that came from messages: for another fixed frame, after a jump of time, and by the button.
  reset() {
    for (const display of this.all()) display.reset();
    this.invalidate();
  }

  close() {
    for (const display of this.displays) display.close();
    for (const stop of this.stops) stop();
    this.renderer.dispose();
  }

  // -- time and transforms ------------------------------------------------------------------------------------------------

  now() {
    return this.simulatedNs ?? BigInt(Math.round(Date.now() * 1e3)) * 1000n;
  }

  setClock(clock) {
    if (clock < this.simulatedNs) {
      this.frames.clear();
      this.reset();
    }
    this.simulatedNs = clock;
  }

  addTransforms({ transforms }, isStatic) {
    for (const { header, child_frame_id: child, transform } of transforms) this.frames.insert(header.frame_id, child, header.stamp, poseOf(transform), "", isStatic);
  }

  // Returns the pose of a frame in the fixed frame. Throws a TransformError.
  poseOf(frame, stamp) {
    return this.frames.lookup(this.fixedFrame, frame, stamp);
  }

  // Returns a status text for a frame without a transform, as rviz writes it.
  whyNot(frame, error) {
    if (!this.frames.has(frame)) return `For frame [${frame}]: Frame [${frame}] does not exist`;
    if (!this.frames.has(this.fixedFrame)) return `For frame [${frame}]: Fixed Frame [${this.fixedFrame}] does not exist`;
    return `For frame [${frame}]: No transform to fixed frame [${this.fixedFrame}].  TF error: [${error.message}]`;
  }

  // Returns which link between a frame and the fixed frame is the oldest, and how old; empty if that explains nothing.
  oldestLink(frame) {
    const moving = [];
    for (let child of [frame, this.fixedFrame]) {
      for (const [stamp, parent] of this.frames.ancestors(child)) {
        if (stamp > 0n) moving.push({ child, parent, stamp });
        child = parent;
      }
    }
    const [oldest] = moving.sort((one, other) => (one.stamp < other.stamp ? -1 : 1));
    if (!oldest) return "";
    const age = Number(this.now() - oldest.stamp) / 1e9;
    return age > LINK_AGE_S ? `The transform from [${oldest.child}] to [${oldest.parent}] is ${age.toFixed(0)} s old; its sender may have stopped.` : "";
  }

  // Returns the status of the fixed frame: [level, text].
  fixedFrameStatus() {
    if (this.frames.has(this.fixedFrame)) return ["ok", "OK"];
    if (!this.frames.names().length) return ["warning", "No TF data"];
    return ["error", `Unknown frame ${this.fixedFrame}`];
  }

  // Returns the frames that would show something as the fixed frame, the largest tree first: roots of trees without it.
  otherRoots() {
    const sizes = new Map();
    for (const name of this.frames.names()) {
      let root = name;
      for (const [, parent] of this.frames.ancestors(name)) root = parent;
      sizes.set(root, (sizes.get(root) ?? 0) + 1);
      if (name === this.fixedFrame) sizes.set(root, -Infinity);
    }
    return [...sizes].filter(([, size]) => size > 1).sort((one, other) => other[1] - one[1]).map(([root]) => root);
  }

  // -- data ---------------------------------------------------------------------------------------------------------------

  topicName(text) {
    return !text || text.startsWith("/") ? text : `/${text}`;
  }

  // Calls `take(message, arrival)` with each message of a topic, decoded. Returns a function that ends it.
  subscribe(name, queue, take, onError = (_text) => {}) {
    let decode = null;
    let isOver = false;
    const receive = async (data) => {
      if (!(data instanceof DataView)) {
        if (data.layout?.error) onError(data.layout.error);
        if (data.layout?.types) decode = decoderOf(data.layout.types, data.layout.type);
        return;
      }
      const batch = await unpacked(data);
      if (isOver || !decode) return;
      for (let at = 0; at + 12 <= batch.byteLength;) {
        const size = batch.getUint32(at + 8, true);
        const body = new DataView(batch.buffer, batch.byteOffset + at + 12, size);
        const arrival = batch.getFloat64(at, true);
        at += 12 + size;
        try {
          take(decode(body), arrival);
        } catch (error) {
          onError(error.message);
        }
      }
      this.invalidate();
    };
    // One after the other: a compressed batch must not be passed by the next one.
    let turn = Promise.resolve();
    const stop = this.context.watch("scene_messages", { name, queue, deflate: !isLocal }, (data) => { turn = turn.then(() => receive(data)).catch((error) => onError(error.message)); }, (text) => text && onError(text));
    return () => {
      isOver = true;
      stop();
    };
  }

  // Returns a promise of the bytes of a mesh or texture.
  resource(uri) {
    return new Promise((resolve, reject) => {
      const stop = live.watch("scene_resource", { uri }, (data) => {
        stop();
        resolve(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
      }, (text) => {
        stop();
        reject(new Error(text));
      });
    });
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
    if (!isNew || elapsed < interval - 2) return;
    this.last = { time, version: this.frames.version };
    this.isDirty = false;
    this.draw();
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height || this.isLost || !this.view) return;
    const begin = performance.now();
    for (const display of this.all()) {
      if (!display.isOn) continue;
      try {
        if (display.waiting.length) display.placeWaiting();
        display.frame();
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
    this.light.intensity = this.options.get("Default Light") ? Math.PI : 0;
    this.light.position.copy(camera.position);
    this.light.target.position.copy(camera.position).add(camera.getWorldDirection(new THREE.Vector3()));
    this.light.target.updateMatrixWorld();
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

// Returns the messages of a batch, which may be compressed.
export async function unpacked(data) {
  const bytes = new Uint8Array(data.buffer, data.byteOffset + 1, data.byteLength - 1);
  if (!data.getUint8(0)) return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new DataView(await new Response(stream).arrayBuffer());
}

