// Images: not in the scene, but beside it.

import { h } from "../../dom.js";
import { colours } from "../../tabs/images.js";
import { Display } from "../display.js";

const TEXT = new TextDecoder();

export class Image extends Display {
  begin() {
    const base = this.scene.topicName(this.get("Image Topic"));
    if (!base) {
      this.setStatus("Image", "error", "Error subscribing: Empty topic name");
      return;
    }
    const hint = this.get("Transport Hint");
    const name = hint && hint !== "raw" ? `${base}/${hint}` : base;
    this.setStatus("Image", "warning", "No image received");
    this.canvas = h("canvas", { width: 2, height: 2, role: "img", "aria-label": this.name });
    this.figure = h("figure", {}, this.canvas, h("figcaption", {}, this.name));
    this.scene.images?.append(this.figure);
    this.stops.push(this.scene.context.watch("image", { name }, (data) => this.show(data), (text) => text && this.setStatus("Image", "error", text)));
  }

  end() {
    this.figure?.remove();
  }

  reset() {}

  async show(data) {
    const all = new Uint8Array(data.buffer, data.byteOffset);
    const end = all.indexOf(10);
    const head = JSON.parse(TEXT.decode(all.subarray(0, end)));
    const pixels = all.subarray(end + 1);
    try {
      if (head.compressed) this.present(await createImageBitmap(new Blob([pixels], { type: `image/${head.compressed}` })));
      else if (head.width && head.height) {
        const image = new OffscreenCanvas(head.width, head.height);
        image.getContext("2d").putImageData(new ImageData(colours(head, pixels), head.width, head.height), 0, 0);
        this.present(image);
      }
      this.received += 1;
      this.setStatus("Image", "ok", `${this.received} images received`);
    } catch (problem) {
      this.setStatus("Image", "error", problem.message);
    }
  }

  // Shows a canvas or bitmap.
  present(image) {
    Object.assign(this.canvas, { width: image.width, height: image.height });
    this.canvas.getContext("2d").drawImage(image, 0, 0);
  }
}
