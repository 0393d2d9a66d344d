// A stick on the page that a user moves with the pointer or with the keys.

import { h } from "./dom.js";

const KEYS = {
  ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1],
  w: [1, 0], s: [-1, 0], a: [0, 1], d: [0, -1],
};
const REACH = 0.38; // how far the knob moves, as a part of the stick's size

const clamped = (value) => Math.max(-1, Math.min(1, value));
const keyOf = (event) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);

// Calls `onMove` with the position, [forward, left], each from -1 to 1. It moves only while it is on. `signal` removes its listeners.
export function steeringStick(onMove, signal) {
  const knob = h("div", { class: "knob" });
  const element = h("div", { class: "stick", tabindex: 0, role: "application",
    "aria-label": "Stick: the arrow keys or W, A, S and D steer, the space bar stops" }, knob);
  const pressed = new Set();
  let isOn = false;

  function move(position) {
    const [forward, left] = position;
    knob.style.transform = `translate(${-left * REACH * element.clientWidth}px, ${-forward * REACH * element.clientHeight}px)`;
    onMove(position);
  }

  const release = () => { pressed.clear(); move([0, 0]); };
  const sum = () => [...pressed].map((key) => KEYS[key]).reduce((all, one) => [all[0] + one[0], all[1] + one[1]], [0, 0]);
  element.addEventListener("keydown", (event) => {
    if (event.key === " ") release();
    else if (keyOf(event) in KEYS && !event.ctrlKey && !event.metaKey && !event.altKey) {
      pressed.add(keyOf(event));
      move(isOn ? sum().map(clamped) : [0, 0]);
    } else return;
    event.preventDefault();
  });
  element.addEventListener("keyup", (event) => {
    if (pressed.delete(keyOf(event))) move(isOn ? sum().map(clamped) : [0, 0]);
  });
  element.addEventListener("blur", release);
  addEventListener("blur", release, { signal });
  document.addEventListener("visibilitychange", () => { if (document.hidden) release(); }, { signal });

  const drag = (event) => move(dragged(event, element.getBoundingClientRect()));
  element.addEventListener("pointerdown", (event) => {
    if (!isOn) return;
    element.setPointerCapture(event.pointerId);
    drag(event);
  });
  element.addEventListener("pointermove", (event) => { if (isOn && element.hasPointerCapture(event.pointerId)) drag(event); });
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) element.addEventListener(kind, release);

  return {
    element, move,
    setOn(value) {
      isOn = value;
      element.classList.toggle("on", isOn);
    },
  };
}

// Returns the position of a knob that follows the pointer as far as it goes.
function dragged(event, bounds) {
  const [x, y] = [(event.clientX - bounds.left) / bounds.width - 0.5, (event.clientY - bounds.top) / bounds.height - 0.5];
  const far = Math.max(1, Math.hypot(x, y) / REACH);
  return [-y / REACH / far, -x / REACH / far];
}
