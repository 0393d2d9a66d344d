// The world of turtlesim on a canvas: the turtles over the picture, which is drawn on a hidden canvas.

import { showConnection } from "./connection.js";
import { live } from "./live.js";
import { h, replace } from "./dom.js";

const SPEED = 2.0; // as in turtle_teleop_key
const KEYS = { ArrowUp: [SPEED, 0], ArrowDown: [-SPEED, 0], ArrowLeft: [0, SPEED], ArrowRight: [0, -SPEED] };
const LOOKS = 14;

const element = (id) => /** @type {any} */ (document.getElementById(id));
const canvas = element("canvas");
const screen = canvas.getContext("2d");
const picture = document.createElement("canvas");
[picture.width, picture.height] = [canvas.width, canvas.height];
const paper = picture.getContext("2d");
let turtles = [];
let pending = Promise.resolve(); // pictures are decoded in the background; later lines wait for them
let isClosed = false;

function drawLine([x0, y0, x1, y1, width, r, g, b]) {
  paper.strokeStyle = `rgb(${r} ${g} ${b})`;
  paper.lineWidth = width;
  paper.lineCap = "square";
  paper.beginPath();
  paper.moveTo(x0 + 0.5, y0 + 0.5);
  paper.lineTo(x1 + 0.5, y1 + 0.5);
  paper.stroke();
}

function ellipse(x, y, width, height, fill) {
  screen.fillStyle = fill;
  screen.beginPath();
  screen.ellipse(x, y, width, height, 0, 0, 2 * Math.PI);
  screen.fill();
}

// Draws a turtle that faces right, about 40 pixels long. `look` determines its colours and pattern.
function drawTurtle(look) {
  const hue = (look * 360) / LOOKS;
  const skin = `hsl(${hue + 60} 45% 38%)`;
  for (const side of [-1, 1]) {
    ellipse(10, side * 12, 6, 4, skin);
    ellipse(-10, side * 11, 5, 4, skin);
  }
  ellipse(-16, 0, 5, 2, skin);
  ellipse(18, 0, 6, 5, skin);
  ellipse(20, -2, 1, 1, "#fff");
  ellipse(20, 2, 1, 1, "#fff");
  ellipse(0, 0, 14, 12, `hsl(${hue} 55% 30%)`);
  ellipse(0, 0, 12, 10, `hsl(${hue} 60% 48%)`);
  const spots = 3 + (look % 4);
  for (let spot = 0; spot < spots; spot += 1) {
    const angle = (spot * 2 * Math.PI) / spots;
    ellipse(7 * Math.cos(angle), 6 * Math.sin(angle), 2.5, 2.5, `hsl(${hue} 60% 34%)`);
  }
  ellipse(0, 0, 3.5, 3, `hsl(${hue} 60% 34%)`);
}

function draw() {
  screen.drawImage(picture, 0, 0);
  for (const [, x, y, theta, look] of turtles) {
    screen.save();
    screen.translate(x + 0.5, y + 0.5);
    screen.rotate(-theta);
    drawTurtle(look);
    screen.restore();
  }
}

function listTurtles() {
  const names = turtles.map(([name]) => name);
  const select = element("turtle");
  if (names.join("/") === [...select.options].map((option) => option.value).join("/")) return;
  const before = select.value;
  replace(select, names.map((name) => h("option", { value: name }, name)));
  if (names.includes(before)) select.value = before;
}

async function show(data) {
  element("node").textContent = data.node;
  document.title = `TurtleSim ${data.node}`;
  turtles = data.turtles;
  if (data.picture) {
    const image = new Image();
    image.src = `data:image/png;base64,${data.picture}`;
    await image.decode();
    paper.drawImage(image, 0, 0);
  }
  data.lines?.forEach(drawLine);
  canvas.dataset.turtles = JSON.stringify(turtles);
  listTurtles();
  draw();
}

addEventListener("keydown", (event) => {
  const speeds = KEYS[event.key];
  if (!speeds || event.target === element("turtle")) return;
  event.preventDefault();
  const turtle = element("turtle").value;
  if (turtle) live.act("steer", { turtle, linear: speeds[0], angular: speeds[1] }).catch((error) => console.warn(error.message));
});
element("close").addEventListener("click", () => {
  isClosed = true;
  live.act("close").catch(() => {});
});
live.watch("world", {}, (data) => {
  pending = pending.then(() => show(data));
});
showConnection("world", "turtlesim", { ended: () => (isClosed ? "turtlesim has ended" : ""), buttons: ["close"] });
