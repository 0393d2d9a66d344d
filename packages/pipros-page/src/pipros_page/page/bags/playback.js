// The bag that this browser has opened, or the recorded past of the running system. While it is open, all tabs show its moment
// instead of the running system.

import { h, replace } from "../dom.js";
import { live } from "../live.js";
import { placeOf } from "../place.js";

class Playback extends EventTarget {
  constructor() {
    super();
    this.name = "";
    this.isRewind = false; // whether the bag is the recorded past
    this.bag = null; // {begin, end, tracks, rewind, …}, once it is open
    this.state = null; // {epoch, moment, playing, speed, loop, error}
    this.opening = null; // while a bag without an index is being read: the part that has been read, from 0 to 1
    this.error = "";
    this.span = 0; // seconds of the past that the server keeps; 0 if it has none
    this.since = 0; // when recording the past began
    this.wanted = null; // the moment to go to once the past is open
    this.goal = null; // the moment of the next jump
    this.jumping = null; // promise that is resolved when all jumps have ended
    this.stop = () => {};
  }

  // The shown moment, or the one to which a jump leads; undefined before the first state.
  get moment() {
    return this.goal ?? this.state?.moment;
  }

  open(name) {
    this.begin(name, { name });
  }

  // Holds all tabs, and shows the recorded past.
  rewind() {
    this.begin("the past", { rewind: true });
  }

  begin(name, args) {
    this.end();
    this.name = name;
    this.isRewind = Boolean(args.rewind);
    if (name) this.stop = live.watch("bag", args, (data) => this.take(data), (error) => this.fail(error));
    this.tell();
  }

  end() {
    this.stop();
    this.stop = () => {};
    const wasOpen = this.bag !== null;
    Object.assign(this, { name: "", isRewind: false, bag: null, state: null, opening: null, error: "", goal: null, wanted: null });
    if (wasOpen) live.restart();
  }

  take(data) {
    if ("opening" in data) this.opening = data.opening;
    if (data.bag) {
      const before = this.state; // if the connection was lost, the state before that
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
    if (data.state && this.wanted !== null) {
      const { wanted } = this;
      this.wanted = null;
      this.jump(wanted);
    }
  }

  fail(error) {
    if (!error) return;
    const { isRewind } = this;
    this.end();
    Object.assign(this, { error, isRewind });
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

  // Whether the tabs can show a moment: of the bag, or of the recorded past.
  canShow(time) {
    if (this.bag) return time >= this.bag.begin && time <= this.bag.end;
    const now = Date.now() / 1000;
    return time >= Math.max(this.since, now - this.span) && time <= now;
  }

  // Goes to a moment inside the bag; without a bag, to one of the past. While a jump is being executed, only the newest
  // further goal is kept, because a drag requests many. Returns a promise that is resolved when all jumps have ended; null without a bag.
  jump(time) {
    if (!this.bag) {
      this.rewind();
      this.wanted = time;
      return null;
    }
    this.goal = Math.min(this.bag.end, Math.max(this.bag.begin, time));
    this.tell();
    this.jumping ??= this.makeJumps();
    return this.jumping;
  }

  async makeJumps() {
    while (this.goal !== null) {
      const { goal } = this;
      await this.control({ jump: goal });
      if (this.goal === goal) this.goal = null;
    }
    this.jumping = null;
    this.tell();
  }

  tell() {
    showInHead(this);
    this.dispatchEvent(new Event("change"));
  }
}

// Formats the time since the beginning, such as 1:02.5.
export function elapsed(seconds) {
  const whole = Math.max(0, seconds);
  return `${Math.floor(whole / 60)}:${(whole % 60).toFixed(1).padStart(4, "0")}`;
}

const toggle = h("button", { class: "plain", "aria-keyshortcuts": "Space",
  onclick: () => playback.control({ play: !playback.state?.playing }) });
const link = h("a", {});

// Shows in the head that the tabs show a bag, with a button to pause it from every tab.
function showInHead({ name, bag, state }) {
  const place = document.getElementById("shown-bag");
  place.hidden = !bag;
  if (!bag || !state) return;
  if (!toggle.isConnected) replace(place, toggle, link);
  link.href = placeOf("bags", bag.rewind ? "" : name);
  link.title = `All tabs show ${bag.rewind ? "the past" : "this bag"}, not the running system`;
  const moment = elapsed(bag.rewind ? bag.end - playback.moment : playback.moment - bag.begin);
  const text = bag.rewind ? `${moment} ago` : `${moment} ${name}`;
  if (link.textContent !== text) link.textContent = text;
  const action = state.playing ? "Pause the bag" : "Play the bag";
  if (toggle.getAttribute("aria-label") === action) return;
  toggle.setAttribute("aria-label", action);
  replace(toggle, state.playing ? "‖" : "▶");
}

export const playback = new Playback();
