// Where the page begins if its address names no view: at the last one, and the first time at the layout "Robot".

import { h } from "./dom.js";
import { live } from "./live.js";
import { currentPlace, placeOf } from "./place.js";

const KEEP = "pipros.last";
const LONGEST_MS = 3000; // until /tf has had time to arrive

// Returns a promise of the first value of a view that `isEnough`; of the last one after some time, or null.
function firstOf(view, args, isEnough) {
  return new Promise((resolve) => {
    let last = null;
    const finish = () => {
      clearTimeout(timer);
      stop();
      resolve(last);
    };
    const timer = setTimeout(finish, LONGEST_MS);
    const stop = live.watch(view, args, (data) => {
      last = data;
      if (isEnough(data)) setTimeout(finish);
    }, () => {});
  });
}

// Returns a promise of the place of the layout "Robot"; null if no transforms arrive and `isSure` is false.
async function robotPlace(isSure) {
  const [{ packed }, { robotLayout, sceneState }] = await Promise.all([import("./scene/link.js"), import("./panels/robot_layout.js")]);
  const [frames, topics, robot] = await Promise.all([firstOf("frames", {}, ({ frames: found }) => found?.length > 0),
    firstOf("running_topics", {}, () => true), firstOf("scene_robot", { name: "robot_description" }, () => true)]);
  if (!frames?.frames?.length && !isSure) return null;
  const state = sceneState(topics?.topics ?? [], frames?.frames ?? [], Boolean(robot?.links));
  return placeOf("panels", robotLayout(topics?.topics ?? [], await packed(JSON.stringify(state))));
}

// Returns the link in the head that opens the layout "Robot".
export function robotLink() {
  const link = h("a", { href: "#panels", id: "robot", title: "Scene, cameras, plot and console side by side",
    onclick: async (event) => {
      event.preventDefault();
      link.setAttribute("aria-busy", "true");
      location.hash = await robotPlace(true);
      link.removeAttribute("aria-busy");
    } }, "Robot");
  return link;
}

// Remembers the current place for the next time.
export function rememberPlace() {
  try {
    localStorage.setItem(KEEP, location.hash);
  } catch {
    // the browser denies storage to this page
  }
}

// Goes to the first place if the address names none. Returns whether it does so.
export function goHome() {
  if (currentPlace()[0]) return false;
  let last = "";
  try {
    last = localStorage.getItem(KEEP) ?? "";
  } catch {
    // the browser denies storage to this page
  }
  const go = (place) => { if (!currentPlace()[0]) location.replace(place); };
  if (last.length > 1) go(last);
  else robotPlace(false).then((place) => go(place ?? placeOf("graph")));
  return true;
}
