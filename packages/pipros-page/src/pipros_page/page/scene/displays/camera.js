// Camera: an image with the scene drawn over or under it, as the camera sees it.

import * as THREE from "three";
import { CameraModel } from "../camera_model.js";
import { pixelsOf } from "../pixels.js";
import { truth } from "../properties.js";
import { infoTopic } from "./depth.js";
import { Image } from "./image.js";

const MAX_PIXELS = 640; // maximum number of pixels along each side of the picture
const INTERVAL_MS = 100;

export class Camera extends Image {
  begin() {
    super.begin();
    const topic = this.scene.topicName(this.get("Image Topic"));
    if (!topic) return;
    this.still = null; // the newest image, as a canvas
    this.model = null;
    this.drawnAt = 0;
    this.camera = new THREE.PerspectiveCamera();
    this.target = new THREE.WebGLRenderTarget(1, 1, { samples: 4 });
    const info = infoTopic(topic);
    this.setStatus("Camera Info", "warning", `No CameraInfo received on [${info}]. Topic may not exist.`);
    this.stops.push(this.scene.subscribe(info, 1, (message) => this.locate(message),
      (text) => this.setStatus("Camera Info", "error", text)));
  }

  end() {
    super.end();
    this.target?.dispose();
  }

  reset() {
    this.waiting = [];
  }

  parts() {
    return { key: "Visibility", names: this.scene.displays.filter((each) => each !== this && each.name).map(({ name }) => name) };
  }

  locate(info) {
    const model = new CameraModel(info);
    if (model.problem) {
      this.setStatus("Camera Info", "error", model.problem);
      return;
    }
    this.setStatus("Camera Info", "ok", "received");
    this.whenPlaced(info, (_, pose) => {
      this.model = model;
      this.pose = pose;
    });
  }

  present(image) {
    this.still = image;
    this.drawnAt = 0;
    this.scene.invalidate();
  }

  // Draws the image and the scene, at most once per INTERVAL_MS, because the scene is drawn a second time for it.
  frame() {
    const now = performance.now();
    if (!this.still || !this.model || now - this.drawnAt < INTERVAL_MS) return;
    this.drawnAt = now;
    const { still } = this;
    const scale = Math.min(1, MAX_PIXELS / Math.max(still.width, still.height));
    const [width, height] = [still.width, still.height].map((size) => Math.max(1, Math.round(size * scale)));
    const zoom = Math.max(1e-3, this.get("Zoom Factor"));
    this.model.aim(this.camera, this.pose, zoom, this.model.width || still.width, this.model.height || still.height);
    const picture = this.picture(width, height);
    Object.assign(this.canvas, { width, height });
    const drawing = this.canvas.getContext("2d");
    const image = () => drawing.drawImage(still, (width * (1 - zoom)) / 2, (height * (1 - zoom)) / 2, width * zoom, height * zoom);
    const kind = this.get("Image Rendering");
    drawing.fillRect(0, 0, width, height);
    if (kind.startsWith("background")) image();
    drawing.drawImage(picture, 0, 0);
    if (!kind.endsWith("overlay")) return;
    drawing.globalAlpha = Math.min(1, Math.max(0, this.get("Overlay Alpha")));
    image();
    drawing.globalAlpha = 1;
  }

  // Returns a canvas with the scene as the camera sees it, on a transparent background.
  picture(width, height) {
    const { displays, tools } = this.scene;
    const hidden = [tools, ...this.hiddenOf(displays, this.config.Visibility).map(({ root }) => root)];
    this.target.setSize(width, height);
    hidden.forEach((each) => { each.visible = false; });
    const canvas = new OffscreenCanvas(width, height);
    try {
      const pixels = pixelsOf(this.scene, this.camera, this.target, [0, 0, width, height]);
      canvas.getContext("2d").putImageData(new ImageData(upright(pixels, width, height), width, height), 0, 0);
    } finally {
      hidden.forEach((each) => { each.visible = true; });
    }
    return canvas;
  }

  // Returns the displays that the property Visibility hides in this one; a group has a map of its displays there.
  hiddenOf(displays, switches) {
    const isMap = typeof switches === "object" && switches;
    const isOff = isMap && !truth(switches.Value, true);
    return displays.flatMap((each) => {
      const own = isMap ? switches[each.name] : undefined;
      const isShown = each !== this && !isOff && truth(typeof own === "object" && own ? own.Value : own, true);
      if (each.displays) return this.hiddenOf(each.displays, isShown ? own : { Value: "false" });
      return isShown || !each.root.visible ? [] : [each];
    });
  }
}

// Turns rows upside down, and premultiplied colours into plain ones.
function upright(pixels, width, height) {
  const out = new Uint8ClampedArray(pixels.length);
  for (let y = 0; y < height; y += 1) out.set(pixels.subarray((height - 1 - y) * width * 4, (height - y) * width * 4), y * width * 4);
  for (let at = 0; at < out.length; at += 4) {
    const alpha = out[at + 3];
    if (alpha === 0 || alpha === 255) continue;
    for (let channel = 0; channel < 3; channel += 1) out[at + channel] = (out[at + channel] * 255) / alpha;
  }
  return out;
}
