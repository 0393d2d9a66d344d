// The rectangle that the tool Select draws on the picture.

import { h } from "../dom.js";

export class Rectangle {
  constructor(canvas) {
    this.canvas = canvas;
    this.corner = null; // the pixel at which the user began; null while no rectangle is drawn
    this.element = h("div", { class: "scene-rectangle", hidden: true });
  }

  begin(pixel) {
    this.corner = pixel;
  }

  extend(pixel) {
    const [left, top, width, height] = this.to(pixel);
    Object.assign(this.element.style, { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` });
    this.element.hidden = false;
  }

  // Ends the rectangle at a pixel, and returns its left, top, width and height.
  end(pixel) {
    const found = this.to(pixel);
    this.drop();
    return found;
  }

  drop() {
    this.corner = null;
    this.element.hidden = true;
  }

  to(pixel) {
    const sizes = [this.canvas.clientWidth, this.canvas.clientHeight];
    const within = (value, axis) => Math.max(0, Math.min(sizes[axis] - 1, value));
    const [left, top] = pixel.map((value, axis) => within(Math.min(this.corner[axis], value), axis));
    const [right, bottom] = pixel.map((value, axis) => within(Math.max(this.corner[axis], value), axis));
    return [left, top, right - left + 1, bottom - top + 1];
  }
}
