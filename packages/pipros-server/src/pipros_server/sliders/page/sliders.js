// Sliders and buttons of a node. A slider that the user is dragging is not moved; the others follow the node.

import { showConnection } from "./connection.js";
import { h, replace } from "./dom.js";
import { live } from "./live.js";

const STEPS = 1000;
const HOLD_MS = 100;

const element = (id) => document.getElementById(id);
const rows = new Map(); // by name of the slider
const held = new Map(); // values that this page has set and repeats, by name of the slider
let shape = "";
let holds = false;
let pending = 0; // actions without an answer

function act(action, args) {
  pending += 1;
  live.act(action, args).catch((error) => console.warn(error.message)).finally(() => { pending -= 1; });
}

// Nothing piles up on a slow connection, and a suspended browser is silent: the node then stops the robot.
function hold() {
  if (!holds || pending || !live.isCurrent) return;
  for (const [slider, value] of held) act("hold", { slider, value });
}

function text(value, unit) {
  return `${value.toFixed(3)} ${unit}`.trim();
}

function row([name, lowest, highest, , unit]) {
  const step = (highest - lowest) / STEPS || "any";
  const input = h("input", { type: "range", min: lowest, max: highest, step, "aria-label": name });
  const output = h("output", {});
  input.addEventListener("input", () => {
    output.textContent = text(input.valueAsNumber, unit);
    held.set(name, input.valueAsNumber);
    act("move", { slider: name, value: input.valueAsNumber });
  });
  rows.set(name, { input, output });
  return [h("span", {}, name), input, output];
}

function build(data) {
  rows.clear();
  replace(element("sliders"), data.sliders.flatMap(row));
  const buttons = data.buttons.map((label) => {
    const button = h("button", { type: "button" }, label);
    button.addEventListener("click", () => act("press", { button: label }));
    return button;
  });
  replace(element("buttons"), buttons);
}

function show(data) {
  element("title").textContent = data.title;
  element("node").textContent = data.node;
  document.title = `${data.title} ${data.node}`;
  const now = JSON.stringify(data.sliders.map(([name, lowest, highest, , unit]) => [name, lowest, highest, unit]));
  if (now !== shape) build(data);
  shape = now;
  holds = data.holds;
  for (const [name, , , value, unit] of data.sliders) {
    if (!pending && held.get(name) !== value) held.delete(name);
    const { input, output } = rows.get(name);
    if (input.matches(":active")) continue;
    input.value = value;
    output.textContent = text(value, unit);
  }
}

setInterval(hold, HOLD_MS);
live.watch("sliders", {}, show);
showConnection("panel", "the node");
