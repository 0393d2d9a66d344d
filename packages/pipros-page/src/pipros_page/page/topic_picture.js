// A small picture of the newest message of a topic: an image, a scan, a map or a path, as the server prepares it.

import { h } from "./dom.js";
import { drawImage, extremes } from "./image_drawing.js";

const [WIDTH, HEIGHT, EDGE] = [300, 200, 8];
const UNKNOWN = 255;

const bytesOf = (text) => Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));

// Returns {element, take(picture)}; the element is hidden while there is no picture.
export function topicPicture() {
  const canvas = h("canvas", { class: "topic-picture", role: "img", "aria-label": "Picture of the newest message" });
  const element = h("div", { hidden: true }, canvas);
  const drawPicture = (_, { data }) => drawImage(canvas, new DataView(bytesOf(data).buffer), extremes, null, true);
  const draw = { points: drawPoints, grid: drawGrid, image: drawPicture };

  async function take(picture) {
    try {
      if (picture) await draw[picture.kind](canvas.getContext("2d"), picture);
      element.hidden = !picture;
    } catch {
      element.hidden = true; // an image that the browser cannot decode
    }
  }

  return { element, take };
}

const colour = (name) => getComputedStyle(document.body).getPropertyValue(name);

// Draws points in metres, with x (a robot's forward direction) upwards, and the origin as a square.
function drawPoints(drawing, { points, joined }) {
  Object.assign(drawing.canvas, { width: WIDTH, height: HEIGHT });
  const rights = points.filter((_, index) => index % 2 === 1).map((y) => -y);
  const downs = points.filter((_, index) => index % 2 === 0).map((x) => -x);
  const isFar = joined && points.length > 0; // a path may be far from the origin
  const [left, right] = [Math.min(...rights, isFar ? Infinity : 0), Math.max(...rights, isFar ? -Infinity : 0)];
  const [top, bottom] = [Math.min(...downs, isFar ? Infinity : 0), Math.max(...downs, isFar ? -Infinity : 0)];
  const scale = Math.min((WIDTH - 2 * EDGE) / (right - left || 1), (HEIGHT - 2 * EDGE) / (bottom - top || 1));
  const at = (x, y) => [WIDTH / 2 + (x - (left + right) / 2) * scale, HEIGHT / 2 + (y - (top + bottom) / 2) * scale];
  const origin = at(0, 0);
  drawing.strokeStyle = colour("--pale");
  drawing.strokeRect(origin[0] - 3, origin[1] - 3, 6, 6);
  drawing.fillStyle = drawing.strokeStyle = colour("--accent");
  drawing.lineWidth = 1.5;
  drawing.beginPath();
  rights.forEach((x, index) => {
    const place = at(x, downs[index]);
    if (joined) drawing.lineTo(place[0], place[1]);
    else drawing.fillRect(place[0] - 1, place[1] - 1, 2, 2);
  });
  drawing.stroke();
}

// Draws a map: free cells white, occupied ones black, unknown ones grey, from the lower left corner.
function drawGrid(drawing, { width, height, cells }) {
  Object.assign(drawing.canvas, { width, height });
  const image = new ImageData(width, height);
  bytesOf(cells).forEach((cell, index) => {
    const row = height - 1 - Math.floor(index / width);
    const shade = cell === UNKNOWN ? 128 : 255 - Math.min(cell, 100) * 2.55;
    image.data.set([shade, shade, shade, 255], (row * width + (index % width)) * 4);
  });
  drawing.putImageData(image, 0, 0);
}
