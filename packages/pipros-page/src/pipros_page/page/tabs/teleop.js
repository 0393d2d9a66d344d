// Steer a robot with the keys or a touch stick. The server stops the robot if this page sends no commands.

import { runningNote } from "../bags/running_note.js";
import { h, problemLine, replace, uniqueId } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { imageStage } from "../image_stage.js";
import { live } from "../live.js";
import { camerasOf } from "../panels/robot_layout.js";
import { steeringStick } from "../steering_stick.js";
import { toolbar } from "../toolbar.js";

const HINT = "Hold the arrow keys or W, A, S, D, or drag the knob. Letting go stops the robot. The server stops it, too, if this page " +
  "is silent for half a second.";
const TYPE = "geometry_msgs/Twist";
const USUAL = "/cmd_vel";
const PERIOD_MS = 100;

export function open(view, argument, context) {
  const { control } = context;
  const names = h("datalist", { id: uniqueId("velocity-topics") });
  const topic = h("input", { value: argument || USUAL, list: names.id, "aria-label": "Topic", spellcheck: "false",
    onchange: () => { isChosen = true; setOn(false); context.remember(topic.value); } });
  const limit = (title, value) => h("input", { type: "number", value, min: 0, step: 0.1, "aria-label": title,
    onchange: () => { if (isOn) begin(); } });
  const [fastest, quickest] = [limit("Highest speed in m/s", 0.5), limit("Highest turn rate in rad/s", 1)];
  const power = h("button", { disabled: !control, "aria-pressed": "false", onclick: () => setOn(!isOn) }, "Start");
  const stick = steeringStick((position) => { wanted = position; draw(); send(); }, context.signal);
  const figures = h("div", { class: "figures", role: "status" });
  const error = problemLine();
  const camera = cameraView(context);
  view.append(h("div", { class: "column" }, runningNote(context.signal), toolbar({ title: "Teleop" }), error.element,
    h("div", { class: "scroll form steering" },
    control ? null : h("p", { class: "note" }, "This page is read-only. Start it with --control to steer."),
    h("label", {}, "Topic", topic), names, h("label", {}, "Speed limit, m/s", fastest), h("label", {}, "Turn limit, rad/s", quickest),
    h("p", {}, power), stick.element, figures, h("p", { class: "note" }, HINT))), camera.element);
  const session = commandSession(context, (problem) => { if (isOn) error.show(problem); });
  let isOn = false;
  let isChosen = Boolean(argument); // whether the user chose the topic
  let listeners = null;
  let wanted = [0, 0]; // forward and left, from -1 to 1

  function setOn(value) {
    isOn = value;
    power.setAttribute("aria-pressed", String(isOn));
    replace(power, isOn ? "Stop" : "Start");
    stick.setOn(isOn);
    session.end();
    stick.move([0, 0]);
    if (!isOn) return;
    begin();
    stick.element.focus();
  }

  function begin() {
    error.show();
    const limits = { linear: Number(fastest.value), angular: Number(quickest.value) };
    session.begin({ name: topic.value, ...limits }, (data) => { listeners = data.listeners; draw(); }, turnOff);
  }

  const turnOff = (reason) => { setOn(false); error.show(reason); };

  const velocity = () => ({ linear: wanted[0] * Number(fastest.value), angular: wanted[1] * Number(quickest.value) });

  function draw() {
    const { linear, angular } = velocity();
    replace(figures, `${linear.toFixed(2)} m/s, ${angular.toFixed(2)} rad/s`,
      isOn && listeners !== null ? `, ${listeners || "no"} subscriber${listeners === 1 ? "" : "s"}` : "");
  }

  const send = () => { if (isOn && live.isCurrent) session.send(velocity(), !wanted[0] && !wanted[1]); };
  const timer = setInterval(send, PERIOD_MS);
  context.signal.addEventListener("abort", () => clearInterval(timer));

  // Steering does not resume by itself, because the user may have left.
  for (const event of ["state", "silence"]) live.addEventListener(event, () => {
    if (!isOn || live.isCurrent) return;
    turnOff(live.isOpen ? "The server does not answer. Unless it is suspended, it has stopped the robot. Start again."
      : "The connection to the server was lost, and the robot was stopped. Start again.");
  }, { signal: context.signal });

  context.watch("running_topics", {}, (data) => {
    const known = data.topics.filter((each) => each.type === TYPE).map((each) => each.name);
    replace(names, known.map((value) => h("option", { value })));
    if (!isChosen && !isOn) topic.value = steerable(data.topics, topic.value);
    camera.look(camerasOf(data.topics)[0] ?? "");
  });
  context.onShown = (isShown) => { if (!isShown && isOn) setOn(false); };
  draw();
  return { go: (name) => {
    if (name === topic.value || !name) return;
    setOn(false);
    isChosen = true;
    topic.value = name;
  } };
}

// Returns the velocity topic to offer: the first that has a subscriber, or the present one if it has one or none has.
function steerable(topics, present) {
  const heard = topics.filter((each) => each.type === TYPE && each.subscribers.length).map((each) => each.name);
  return heard.includes(present) ? present : heard[0] ?? present;
}

// A session in which the server publishes commands. `onError` is called with the text of a command that failed.
function commandSession(context, onError) {
  let session = "";
  let stop = () => {};
  let isSent = true; // whether the last command that was sent is zero
  let isWaiting = false; // whether the answer to a command is pending

  function end() {
    stop();
    stop = () => {};
  }

  // Opens a session instead of the last one. `limits` are those that the server enforces, and the name of the topic.
  function begin(limits, onData, onEnd) {
    end();
    const own = [...crypto.getRandomValues(new Uint32Array(4))].join("-");
    session = own;
    stop = context.watch("teleop", { session, ...limits }, onData, (problem) => { if (session === own && problem) onEnd(problem); });
  }

  async function send(velocity, isZero) {
    if (isZero ? isSent : isWaiting) return;
    isSent = isZero;
    isWaiting = true; // so that no commands pile up on a slow connection and move the robot later
    try {
      await context.act("steer", { session, ...velocity });
    } catch (problem) {
      onError(problem.message);
    } finally {
      isWaiting = false;
    }
  }

  return { begin, end, send };
}

// The picture beside the stick: what a camera of the robot sees.
function cameraView(context) {
  const stage = imageStage("Camera");
  const hint = emptyState("▧");
  let shown = null;
  let stop = () => {};

  function look(name) {
    if (name === shown) return;
    shown = name;
    stop();
    stage.clear();
    hint.hidden = false;
    replace(hint, name ? `No image received yet on ${name}.` : "No camera to show beside the stick.");
    if (name) stop = context.watch("image", { name }, (data) => {
      if (data instanceof DataView) stage.show(data).then(() => { hint.hidden = true; }, (problem) => replace(hint, problem.message));
    });
  }

  return { element: h("div", { class: "beside" }, hint, stage.area), look };
}
