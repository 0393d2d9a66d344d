// DepthCloud: the points of a depth image, with the colours of another image.

import { CameraModel } from "../camera_model.js";
import { Cloud } from "./clouds.js";

const MAX_POINTS = 200000;
const RAW = "raw";

export class DepthCloud extends Cloud {
  begin() {
    super.begin();
    const depth = this.scene.topicName(this.get("Depth Map Topic"));
    this.received = 0;
    if (!depth) {
      this.setStatus("Depth Map", "error", "Error subscribing: Empty topic name");
      return;
    }
    for (const hint of ["Depth Map Transport Hint", "Color Transport Hint"]) {
      if (this.get(hint) !== RAW) this.setStatus(hint, "error", `Only the transport raw is supported, not ${this.get(hint)}`);
    }
    this.model = null;
    this.colours = null;
    this.setStatus("Depth Map", "ok", "0 depth maps received");
    this.listen(depth, (message) => this.take(message));
    this.listen(infoTopic(depth), (info) => { this.model = new CameraModel(info); });
    const colour = this.scene.topicName(this.get("Color Image Topic"));
    if (colour) this.listen(colour, (image) => { this.colours = image; });
  }

  listen(topic, take) {
    this.stops.push(this.scene.subscribe(topic, 1, take, (text) => this.setStatus(topic, "error", text)));
  }

  take(image) {
    this.received += 1;
    this.setStatus("Depth Map", "ok", `${this.received} depth maps received`);
    const { model } = this;
    if (!model) {
      this.setStatus("Camera Info", "error", `No CameraInfo received on ${infoTopic(this.scene.topicName(this.get("Depth Map Topic")))}`);
      return;
    }
    if (model.problem) {
      this.setStatus("Camera Info", "error", model.problem);
      return;
    }
    this.dropStatus("Camera Info");
    try {
      const columns = depthColumns(image, model, this.colours);
      this.setStatus("Message", "ok", "Ok");
      this.setStatus("Depth Image Size", "ok", `${image.width} x ${image.height}`);
      this.model = model;
      this.whenPlaced(image, (_, pose) => this.show(columns, pose));
    } catch (error) {
      this.setStatus("Message", "error", error.message);
    }
  }

  // With Auto Size, each point covers its pixel: its size is this number times its depth.
  sizePerDepth() {
    return this.get("Auto Size") && this.model ? this.get("Auto Size", "Auto Size Factor") / this.model.fx : 0;
  }
}

// Returns the topic of the CameraInfo beside an image.
export const infoTopic = (topic) => `${topic.slice(0, topic.lastIndexOf("/"))}/camera_info`;

// Returns x, y, z and rgb of the points of a depth image, every n-th row and column of large ones.
function depthColumns(image, model, colours) {
  const { width, height, step, encoding } = image;
  const isMillimetres = encoding === "16UC1" || encoding === "mono16";
  if (!isMillimetres && encoding !== "32FC1") throw new Error(`The depth map has the encoding [${encoding}], not 16UC1 or 32FC1`);
  const size = isMillimetres ? 2 : 4;
  if (step < width * size || image.data.length < step * height) throw new Error("The depth map has fewer bytes than its size requires");
  const paint = colourReader(colours, width, height);
  const depthAt = depthReader(image, isMillimetres);
  let every = 1;
  while (Math.ceil(width / every) * Math.ceil(height / every) > MAX_POINTS) every += 1;
  const most = Math.ceil(width / every) * Math.ceil(height / every);
  const columns = [0, 1, 2].map(() => new Float32Array(most));
  const rgb = paint ? new Uint32Array(most) : null;
  let count = 0;
  for (let row = 0; row < height; row += every) {
    for (let column = 0; column < width; column += every) {
      const depth = depthAt(row * step + column * size);
      if (!(depth > 0) || !Number.isFinite(depth)) continue;
      columns[0][count] = ((column - model.cx) * depth) / model.fx;
      columns[1][count] = ((row - model.cy) * depth) / model.fy;
      columns[2][count] = depth;
      if (rgb) rgb[count] = paint(row, column);
      count += 1;
    }
  }
  /** @type {Map<string, Float32Array | Uint32Array>} */
  const found = new Map(["x", "y", "z"].map((name, axis) => [name, columns[axis].slice(0, count)]));
  if (rgb) found.set("rgb", rgb.slice(0, count));
  return found;
}

// Returns a function that reads the depth at an offset, in metres.
function depthReader(image, isMillimetres) {
  const data = new DataView(image.data.buffer, image.data.byteOffset, image.data.byteLength);
  const isLittle = !image.is_bigendian;
  return isMillimetres ? (at) => data.getUint16(at, isLittle) / 1000 : (at) => data.getFloat32(at, isLittle);
}

const CHANNELS = { rgb8: [0, 1, 2, 3], bgr8: [2, 1, 0, 3], rgba8: [0, 1, 2, 4], bgra8: [2, 1, 0, 4], mono8: [0, 0, 0, 1] };

// Returns a function from row and column to the packed colour there, or null without a colour image. Throws an Error if the
// colour image has another size, an unsupported encoding or too few bytes.
function colourReader(image, width, height) {
  if (!image) return null;
  const channels = CHANNELS[image.encoding];
  if (!channels) throw new Error(`The color image has the encoding [${image.encoding}], not one of ${Object.keys(CHANNELS).join(", ")}`);
  if (image.width !== width || image.height !== height) throw new Error("The depth map and the color image differ in size");
  const [r, g, b, size] = channels;
  if (image.step < width * size || image.data.length < image.step * height)
    throw new Error("The color image has fewer bytes than its size requires");
  return (row, column) => {
    const at = row * image.step + column * size;
    return (image.data[at + r] << 16) | (image.data[at + g] << 8) | image.data[at + b];
  };
}
