// The bag that this browser has opened. While it is open, all tabs show its moment instead of the running system.

import { h, replace } from "../dom.js";
import { live } from "../live.js";
import { placeOf } from "../place.js";

class Playback extends EventTarget {
  constructor() {
    super();
    this.name = "";
    this.bag = null; // {begin, end, tracks, …}, once it is open
    this.state = null; // {epoch, moment, playing, speed, loop, error}
    this.opening = null; // while a bag without an index is being read: the part that has been read, from 0 to 1
    this.error = "";
    this.stop = () => {};
  }

  open(name) {
    this.end();
    this.name = name;
    if (name) this.stop = live.watch("bag", { name }, (data) => this.take(data), (error) => this.fail(error));
    this.tell();
  }

  end() {
    this.stop();
    this.stop = () => {};
    const wasOpen = this.bag !== null;
    Object.assign(this, { name: "", bag: null, state: null, opening: null, error: "" });
    if (wasOpen) live.restart();
  }

  take(data) {
    if ("opening" in data) this.opening = data.opening;
    if (data.bag) {
      const before = this.state; // from before the connection was lost, if it was
      Object.assign(this, { bag: data.bag, opening: null, error: "", state: null });
      live.restart();
      if (before) this.control({ jump: before.moment, speed: before.speed, loop: before.loop, play: before.playing });
    }
    if (data.state) {
      const isElsewhere = this.state && this.state.epoch !== data.state.epoch;
      this.state = data.state;
      if (isElsewhere) live.restart();
    }
    this.tell();
  }

  fail(error) {
    if (!error) return;
    this.end();
    this.error = error;
    this.tell();
  }

  async control(args) {
    try {
      this.take({ state: await live.act("bag_control", args) });
    } catch (problem) {
      this.error = problem.message;
      this.tell();
    }
  }

  // Whether the tabs can show a moment.
  canShow(time) {
    return this.bag !== null && time >= this.bag.begin && time <= this.bag.end;
  }

  // Shows a moment in all tabs.
  jump(time) {
    return this.control({ jump: time });
  }

  tell() {
    showInHead(this);
    this.dispatchEvent(new Event("change"));
  }
}

// The time since the beginning, as 1:02.5
export function elapsed(seconds) {
  const whole = Math.max(0, seconds);
  return `${Math.floor(whole / 60)}:${(whole % 60).toFixed(1).padStart(4, "0")}`;
}

const toggle = h("button", { class: "plain", onclick: () => playback.control({ play: !playback.state?.playing }) });
const link = h("a", {});

// Shows in the head that the tabs show a bag, with a button to pause it from every tab.
function showInHead({ name, bag, state }) {
  const place = document.getElementById("shown-bag");
  place.hidden = !bag;
  if (!bag || !state) return;
  if (!toggle.isConnected) replace(place, toggle, link);
  link.href = placeOf("bags", name);
  link.title = "All tabs show this bag, not the running system";
  const text = `${name} ${elapsed(state.moment - bag.begin)}`;
  if (link.textContent !== text) link.textContent = text;
  const action = state.playing ? "Pause the bag" : "Play the bag";
  if (toggle.getAttribute("aria-label") === action) return;
  toggle.setAttribute("aria-label", action);
  replace(toggle, state.playing ? "‖" : "▶");
}

export const playback = new Playback();
