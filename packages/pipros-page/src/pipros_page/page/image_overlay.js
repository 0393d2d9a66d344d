// Shapes over images, as the view image_overlay sends them, in pixels of the image at its full size.

const LINE = 1 / 300; // width of lines as a part of the image's width
const TEXT = 1 / 45;

// Draws shapes: {color, lines: [x, y, x, y, …] for separate lines, circles: [x, y, radius, …], texts: [[x, y, text], …]}.
// `scale` is the size of a pixel of the full image in the drawing.
export function drawShapes(drawing, shapes, scale) {
  const { width } = drawing.canvas;
  drawing.lineWidth = Math.max(1, width * LINE);
  drawing.font = `${Math.max(9, width * TEXT)}px system-ui, sans-serif`;
  drawing.textBaseline = "bottom";
  for (const { color, lines = [], circles = [], texts = [] } of shapes) {
    drawing.strokeStyle = drawing.fillStyle = color;
    drawing.beginPath();
    for (let at = 0; at + 3 < lines.length; at += 4) {
      drawing.moveTo(lines[at] * scale, lines[at + 1] * scale);
      drawing.lineTo(lines[at + 2] * scale, lines[at + 3] * scale);
    }
    for (let at = 0; at + 2 < circles.length; at += 3) {
      const [x, y, radius] = circles.slice(at, at + 3).map((each) => each * scale);
      drawing.moveTo(x + radius, y);
      drawing.arc(x, y, radius, 0, 2 * Math.PI);
    }
    drawing.stroke();
    for (const [x, y, text] of texts) drawText(drawing, text, x * scale, y * scale, color);
  }
}

// A text on a dark plate, so that it is legible on any image.
function drawText(drawing, text, x, y, color) {
  const { width } = drawing.measureText(text);
  const height = parseFloat(drawing.font) * 1.2;
  drawing.fillStyle = "#000a";
  drawing.fillRect(x, y - height, width + 4, height);
  drawing.fillStyle = color;
  drawing.fillText(text, x + 2, y - height * 0.1);
}
