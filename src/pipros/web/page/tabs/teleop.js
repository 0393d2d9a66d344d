// Steer a robot with the keys or a touch stick. The server stops the robot if this page sends no commands.

import { h, replace, uniqueId } from "../dom.js";
import { live } from "../live.js";

const TYPE = "geometry_msgs/Twist";
const USUAL = "/cmd_vel";
const PERIOD_MS = 100;
const KEYS = {
  ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1],
  w: [1, 0], s: [-1, 0], a: [0, 1], d: [0, -1],
};
const REACH = 0.38; // of the size of the stick: how far its knob goes

export function open(view, argument, context) {
  const { control } = context;
  const names = h("datalist", { id: uniqueId("velocity-topics") });
  const topic = h("input", { value: argument || USUAL, list: names.id, "aria-label": "Topic", spellcheck: "false",
    onchange: () => { setOn(false); context.remember(topic.value); } });
  const limit = (title, value) => h("input", { type: "number", value, min: 0, step: 0.1, "aria-label": title,
    onchange: () => { if (isOn) begin(); } });
  const [fastest, quickest] = [limit("Highest speed in m/s", 0.5), limit("Highest turn rate in rad/s", 1)];
  const power = h("button", { disabled: !control, "aria-pressed": "false", onclick: () => setOn(!isOn) }, "Start");
  const knob = h("div", { class: "knob" });
  const stick = h("div", { class: "stick", tabindex: 0, role: "application",
    "aria-label": "Stick: the arrow keys or W, A, S and D steer, the space bar stops" }, knob);
  const figures = h("div", { class: "figures", role: "status" });
  const error = h("div", { class: "error", role: "alert" });
  view.append(h("div", { class: "column" }, error, h("div", { class: "scroll form steering" },
    control ? null : h("p", { class: "note" }, "This page is read-only. Start it with --control to steer."),
    h("label", {}, "Topic", topic), names, h("label", {}, "Speed limit, m/s", fastest), h("label", {}, "Turn limit, rad/s", quickest),
    h("p", {}, power), stick, figures,
    h("p", { class: "note" }, "Hold the arrow keys or W, A, S, D, or drag the knob. Letting go stops the robot. The server stops it, " +
      "too, if this page is silent for half a second."))));
  let isOn = false;
  let session = "";
  let stop = () => {};
  let listeners = null;
  let wanted = [0, 0]; // forward and left, from -1 to 1
  let isSent = true; // whether the last command that was sent is zero
  let isWaiting = false; // for the answer to a command
  const pressed = new Set();

  function setOn(value) {
    isOn = value;
    power.setAttribute("aria-pressed", String(isOn));
    replace(power, isOn ? "Stop" : "Start");
    stick.classList.toggle("on", isOn);
    stop();
    stop = () => {};
    set([0, 0]);
    if (!isOn) return;
    begin();
    stick.focus();
  }

  // Opens a session, whose limits the server enforces.
  function begin() {
    stop();
    replace(error);
    const own = [...crypto.getRandomValues(new Uint32Array(4))].join("-");
    session = own;
    const limits = { linear: Number(fastest.value), angular: Number(quickest.value) };
    stop = context.watch("teleop", { name: topic.value, session, ...limits }, (data) => {
      listeners = data.listeners;
      draw();
    }, (problem) => {
      if (session !== own || !problem) return;
      setOn(false);
      replace(error, problem);
    });
  }

  function set(next) {
    wanted = next;
    const [forward, left] = wanted;
    knob.style.transform = `translate(${-left * REACH * stick.clientWidth}px, ${-forward * REACH * stick.clientHeight}px)`;
    draw();
    send();
  }

  const velocity = () => ({ linear: wanted[0] * Number(fastest.value), angular: wanted[1] * Number(quickest.value) });

  function draw() {
    const { linear, angular } = velocity();
    replace(figures, `${linear.toFixed(2)} m/s, ${angular.toFixed(2)} rad/s`,
      isOn && listeners !== null ? `, ${listeners || "no"} subscriber${listeners === 1 ? "" : "s"}` : "");
  }

  async function send() {
    const isZero = !wanted[0] && !wanted[1];
    if (!isOn || !live.isOpen || (isZero ? isSent : isWaiting)) return;
    isSent = isZero;
    isWaiting = true; // so that no commands pile up on a slow connection and move the robot later
    try {
      await context.act("steer", { session, ...velocity() });
    } catch (problem) {
      if (isOn) replace(error, problem.message);
    } finally {
      isWaiting = false;
    }
  }

  // Steering does not resume by itself, because the user may have left.
  live.addEventListener("state", () => {
    if (live.isOpen || !isOn) return;
    setOn(false);
    replace(error, "The connection to the server was lost, and the robot was stopped. Start again.");
  }, { signal: context.signal });

  const timer = setInterval(send, PERIOD_MS);
  context.signal.addEventListener("abort", () => clearInterval(timer));

  const release = () => { pressed.clear(); set([0, 0]); };
  const sum = () => [...pressed].map((key) => KEYS[key]).reduce((all, one) => [all[0] + one[0], all[1] + one[1]], [0, 0]);
  const clamped = (value) => Math.max(-1, Math.min(1, value));
  const keyOf = (event) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);
  stick.addEventListener("keydown", (event) => {
    if (event.key === " ") release();
    else if (keyOf(event) in KEYS && !event.ctrlKey && !event.metaKey && !event.altKey) {
      pressed.add(keyOf(event));
      set(isOn ? sum().map(clamped) : [0, 0]);
    } else return;
    event.preventDefault();
  });
  stick.addEventListener("keyup", (event) => {
    if (pressed.delete(keyOf(event))) set(isOn ? sum().map(clamped) : [0, 0]);
  });
  stick.addEventListener("blur", release);
  addEventListener("blur", release, { signal: context.signal });
  document.addEventListener("visibilitychange", () => { if (document.hidden) release(); }, { signal: context.signal });

  function drag(event) {
    const bounds = stick.getBoundingClientRect();
    const [x, y] = [(event.clientX - bounds.left) / bounds.width - 0.5, (event.clientY - bounds.top) / bounds.height - 0.5];
    const far = Math.max(1, Math.hypot(x, y) / REACH);
    set([-y / REACH / far, -x / REACH / far]);
  }
  stick.addEventListener("pointerdown", (event) => {
    if (!isOn) return;
    stick.setPointerCapture(event.pointerId);
    drag(event);
  });
  stick.addEventListener("pointermove", (event) => { if (isOn && stick.hasPointerCapture(event.pointerId)) drag(event); });
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) stick.addEventListener(kind, release);

  context.watch("running_topics", {}, (data) => {
    const known = data.topics.filter((each) => each.type === TYPE).map((each) => each.name);
    replace(names, known.map((value) => h("option", { value })));
  });
  context.onShown = (isShown) => { if (!isShown && isOn) setOn(false); };
  draw();
  return { go: (name) => {
    if (name === topic.value || !name) return;
    setOn(false);
    topic.value = name;
  } };
}
