// The world of simulated robots on a canvas: walls, laser points, and robots that can be dragged.

import { showConnection } from "./connection.js";
import { live } from "./live.js";
import { h, replace } from "./dom.js";

const LINEAR = 0.3;
const ANGULAR = 1;
const KEYS = { ArrowUp: [LINEAR, 0], ArrowDown: [-LINEAR, 0], ArrowLeft: [0, ANGULAR], ArrowRight: [0, -ANGULAR] };
const LONGEST_SIDE = 800; // pixels

const element = (id) => /** @type {any} */ (document.getElementById(id));
const canvas = element("canvas");
const screen = canvas.getContext("2d");
let walls = null;
let area = [0, 0, 1, 1]; // left, bottom, width, height in metres
let scale = 1; // pixels per metre
let robots = [];
let dragged = null; // {name, pose} while a robot is dragged
let isClosed = false;

const toScreen = ([x, y]) => [(x - area[0]) * scale, canvas.height - (y - area[1]) * scale];

function toWorld(event) {
  const box = canvas.getBoundingClientRect();
  const across = ((event.clientX - box.left) * canvas.width) / box.width;
  const down = ((event.clientY - box.top) * canvas.height) / box.height;
  return [area[0] + across / scale, area[1] + (canvas.height - down) / scale];
}

function drawRobot({ name, pose, radius, bumped }) {
  const [x, y] = toScreen(pose);
  const size = radius * scale;
  screen.fillStyle = bumped ? "#c62828" : "#1565c0";
  screen.beginPath();
  screen.arc(x, y, size, 0, 2 * Math.PI);
  screen.fill();
  screen.strokeStyle = "#fff";
  screen.lineWidth = 2;
  screen.beginPath();
  screen.moveTo(x, y);
  screen.lineTo(x + size * Math.cos(pose[2]), y - size * Math.sin(pose[2]));
  screen.stroke();
  screen.fillStyle = "#000";
  screen.fillText(name, x + size + 2, y - size);
}

function draw() {
  screen.clearRect(0, 0, canvas.width, canvas.height);
  if (walls) {
    screen.imageSmoothingEnabled = false;
    screen.drawImage(walls, 0, 0, canvas.width, canvas.height);
  }
  screen.fillStyle = "#e65100";
  for (const robot of robots) {
    for (const point of robot.points) {
      const [x, y] = toScreen(point);
      screen.fillRect(x - 1, y - 1, 2, 2);
    }
  }
  for (const robot of robots) drawRobot(dragged?.name === robot.name ? { ...robot, pose: dragged.pose } : robot);
}

function listRobots() {
  const names = robots.map(({ name }) => name);
  const select = element("robot");
  if (names.length === select.options.length && names.every((name, index) => select.options[index].value === name)) return;
  const chosen = select.value;
  replace(select, names.map((name) => h("option", { value: name }, name || "the robot")));
  if (names.includes(chosen)) select.value = chosen;
}

async function show(data) {
  if (data.walls) {
    element("node").textContent = data.node;
    document.title = `Robots ${data.node}`;
    area = data.area;
    scale = LONGEST_SIDE / Math.max(area[2], area[3]);
    [canvas.width, canvas.height] = [Math.round(area[2] * scale), Math.round(area[3] * scale)];
    const image = new Image();
    image.src = `data:image/png;base64,${data.walls}`;
    await image.decode();
    walls = image;
  } else {
    robots = data.robots;
    canvas.dataset.robots = JSON.stringify(robots.map(({ name, pose }) => [name, ...pose]));
    listRobots();
    const chosen = robots.find(({ name }) => name === element("robot").value);
    element("state").textContent = `time ${data.time.toFixed(1)} s${chosen ? `, battery ${Math.round(chosen.battery * 100)} %` : ""}`;
  }
  draw();
}

function showError(error) {
  element("system").textContent = error.message;
}

canvas.addEventListener("pointerdown", (event) => {
  const [x, y] = toWorld(event);
  const robot = robots.find(({ pose, radius }) => Math.hypot(pose[0] - x, pose[1] - y) <= Math.max(radius, 8 / scale));
  if (!robot) return;
  element("robot").value = robot.name;
  dragged = { name: robot.name, pose: [...robot.pose] };
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener("pointermove", (event) => {
  if (!dragged) return;
  const [x, y] = toWorld(event);
  if (event.shiftKey) dragged.pose[2] = Math.atan2(y - dragged.pose[1], x - dragged.pose[0]);
  else [dragged.pose[0], dragged.pose[1]] = [x, y];
  draw();
});
canvas.addEventListener("pointerup", () => {
  if (!dragged) return;
  const { name, pose } = dragged;
  dragged = null;
  element("system").textContent = "";
  live.act("place", { robot: name, x: pose[0], y: pose[1], yaw: pose[2] }).catch(showError);
});
canvas.addEventListener("pointercancel", () => {
  dragged = null;
});
addEventListener("keydown", (event) => {
  const speeds = KEYS[event.key];
  if (!speeds || event.target === element("robot") || !robots.length) return;
  event.preventDefault();
  live.act("steer", { robot: element("robot").value, linear: speeds[0], angular: speeds[1] }).catch(showError);
});
element("reset").addEventListener("click", () => {
  live.act("reset").catch(showError);
});
element("close").addEventListener("click", () => {
  isClosed = true;
  live.act("close").catch(() => {});
});
let pending = Promise.resolve(); // the walls are decoded in the background; robots wait for them
live.watch("world", {}, (data) => {
  pending = pending.then(() => show(data));
});
showConnection("world", "the simulation", { ended: () => (isClosed ? "the simulation has ended" : ""), buttons: ["close", "reset"] });
