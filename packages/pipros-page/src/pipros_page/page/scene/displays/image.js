// Images, which are shown beside the scene.

import { h } from "../../dom.js";
import { drawImage, extremes } from "../../image_drawing.js";
import { Display } from "../display.js";

export class Image extends Display {
  begin() {
    const base = this.scene.topicName(this.get("Image Topic"));
    if (!base) {
      this.setStatus("Image", "error", "Error subscribing: Empty topic name");
      return;
    }
    this.bounds = []; // the extremes of the newest images
    const hint = this.get("Transport Hint");
    const name = hint && hint !== "raw" ? `${base}/${hint}` : base;
    this.setStatus("Image", "warning", "No Image received");
    this.canvas = h("canvas", { width: 2, height: 2, role: "img", "aria-label": this.name });
    this.figure = h("figure", {}, this.canvas, h("figcaption", {}, this.name));
    this.scene.images?.append(this.figure);
    this.setStatus("Topic", "ok", "OK");
    this.stops.push(this.scene.context.watch("image", { name }, (data) => this.show(data),
      (text) => text && this.setStatus("Image", "error", text)));
  }

  end() {
    this.figure?.remove();
  }

  reset() {}

  async show(data) {
    if (data.error) {
      this.setStatus("Image", "error", data.error);
      return;
    }
    const image = new OffscreenCanvas(2, 2);
    try {
      await drawImage(image, data, (values) => this.boundsOf(values));
      if (!this.isOn) return;
      this.present(image);
      this.received += 1;
      this.setStatus("Image", "ok", `${this.received} images received`);
    } catch (problem) {
      this.setStatus("Image", "error", problem.message);
    }
  }

  // Returns the values of black and white: those of the properties, or the medians of the extremes of the newest images.
  boundsOf(values) {
    const schema = this.properties.find(["Normalize Range"])[0];
    if (schema && !this.get("Normalize Range")) return [this.get("Min Value"), this.get("Max Value")];
    this.bounds.push(extremes(values));
    const most = schema ? Math.max(1, this.get("Median window")) : 1;
    this.bounds.splice(0, this.bounds.length - most);
    return [0, 1].map((end) => median(this.bounds.map((each) => each[end])));
  }

  // Shows a canvas.
  present(image) {
    Object.assign(this.canvas, { width: image.width, height: image.height });
    this.canvas.getContext("2d").drawImage(image, 0, 0);
  }
}

const median = (values) => values.sort((one, other) => one - other)[Math.floor(values.length / 2)];
