// The windows of a program that uses OpenCV: images, trackbars, the mouse, and keys for waitKey.

import { showConnection } from "./connection.js";
import { h, replace } from "./dom.js";
import { live } from "./live.js";

// The codes that OpenCV returns on Linux.
const KEYS = {
  Backspace: 8, Tab: 9, Enter: 13, Escape: 27, Delete: 65535, Home: 65360, End: 65367, Insert: 65379,
  ArrowLeft: 65361, ArrowUp: 65362, ArrowRight: 65363, ArrowDown: 65364, PageUp: 65365, PageDown: 65366,
};
const MOVED = 0;
const DOWN = [1, 3, 2]; // by button: left, middle, right
const UP = [4, 6, 5];
const DOUBLE = [7, 9, 8];
const WHEEL = 10;

const element = (id) => document.getElementById(id);
const shown = new Map(); // by name of the window: {section, image, title, bars, inputs, shape, hasMouse, stop}

function act(action, args) {
  return live.act(action, args).catch((error) => console.warn(error.message));
}

function flags(event) {
  const [left, right, middle] = [1, 2, 4];
  const keys = (event.ctrlKey ? 8 : 0) + (event.shiftKey ? 16 : 0) + (event.altKey ? 32 : 0);
  return (event.buttons & (left | right | middle)) + keys;
}

function listen(image, name, state) {
  let isSending = false;
  function send(code, event, turn = 0) {
    if (!state.hasMouse || !image.naturalWidth) return null;
    const box = image.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) * image.naturalWidth) / box.width);
    const y = Math.floor(((event.clientY - box.top) * image.naturalHeight) / box.height);
    return act("mouse", { window: name, event: code, x, y, flags: flags(event) + turn * 65536 });
  }
  image.addEventListener("mousemove", async (event) => {
    if (isSending) return; // a slow program gets fewer moves, not old ones
    isSending = true;
    await send(MOVED, event);
    isSending = false;
  });
  image.addEventListener("mousedown", (event) => send(DOWN[event.button] ?? MOVED, event));
  image.addEventListener("mouseup", (event) => send(UP[event.button] ?? MOVED, event));
  image.addEventListener("dblclick", (event) => send(DOUBLE[event.button] ?? MOVED, event));
  image.addEventListener("wheel", (event) => {
    if (state.hasMouse) event.preventDefault();
    send(WHEEL, event, -Math.sign(event.deltaY));
  });
  image.addEventListener("contextmenu", (event) => state.hasMouse && event.preventDefault());
}

function open(name) {
  const image = h("img", { alt: name, draggable: "false" });
  const title = h("span", {});
  const close = h("button", { type: "button", "aria-label": `Close ${name}` }, "Close");
  const bars = h("div", { class: "bars" });
  const state = { image, title, bars, inputs: new Map(), shape: "", hasMouse: false };
  state.section = h("section", {}, h("h2", {}, title, close), bars, image);
  close.addEventListener("click", () => act("close", { window: name }));
  listen(image, name, state);
  state.stop = live.watch("image", { window: name }, (data) => {
    const old = image.src;
    image.src = URL.createObjectURL(new Blob([data], { type: "image/jpeg" }));
    if (old) URL.revokeObjectURL(old);
  });
  return state;
}

function buildBars(state, name, trackbars) {
  state.inputs.clear();
  const rows = trackbars.flatMap(([label, lowest, highest]) => {
    const input = h("input", { type: "range", min: lowest, max: highest, step: 1, "aria-label": label });
    const output = h("output", {});
    input.addEventListener("input", () => {
      output.textContent = input.value;
      act("move", { window: name, trackbar: label, value: input.valueAsNumber });
    });
    state.inputs.set(label, { input, output });
    return [h("span", {}, label), input, output];
  });
  replace(state.bars, rows);
}

function show(data) {
  element("node").textContent = data.node;
  document.title = `OpenCV ${data.node}`;
  element("none").hidden = data.windows.length > 0;
  const names = new Set(data.windows.map((window) => window.name));
  for (const [name, state] of shown) {
    if (names.has(name)) continue;
    state.stop();
    state.section.remove();
    shown.delete(name);
  }
  for (const window of data.windows) {
    if (!shown.has(window.name)) {
      shown.set(window.name, open(window.name));
      element("windows").append(shown.get(window.name).section);
    }
    const state = shown.get(window.name);
    state.title.textContent = window.title;
    state.hasMouse = window.hasMouse;
    const shape = JSON.stringify(window.trackbars.map(([label, lowest, highest]) => [label, lowest, highest]));
    if (shape !== state.shape) buildBars(state, window.name, window.trackbars);
    state.shape = shape;
    for (const [label, , , value] of window.trackbars) {
      const { input, output } = state.inputs.get(label);
      if (input.matches(":active")) continue;
      input.value = value;
      output.textContent = String(value);
    }
  }
}

addEventListener("keydown", (event) => {
  const isOnControl = event.target instanceof HTMLInputElement || event.target instanceof HTMLButtonElement;
  if (event.metaKey || (isOnControl && event.key.length > 1 && event.key !== "Escape")) return;
  const code = KEYS[event.key] ?? (event.key.length === 1 ? event.key.codePointAt(0) : null);
  if (code === null || event.key === "Tab") return;
  if (!event.ctrlKey) event.preventDefault();
  act("key", { code });
});

live.watch("windows", {}, show);
showConnection("panel", "the node");
