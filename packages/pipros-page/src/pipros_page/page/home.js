// Where the page begins if its address names no view: at the last place; the first time, at the Overview, or at the
// graph if there are no transforms.

import { h } from "./dom.js";
import { live } from "./live.js";
import { currentPlace, placeOf } from "./place.js";

const KEEP = "pipros.last";
const TRANSFORMS = ["/tf", "/tf_static"];
const LONGEST_MS = 10000; // maximum time for one answer, once connected to the server

// Returns a promise of the first value of a view for which `isEnough` is true; after some time, of the last
// value or null.
function firstOf(view, args, isEnough) {
  return new Promise((resolve) => {
    let last = null;
    const finish = () => {
      clearTimeout(timer);
      live.removeEventListener("state", begin);
      stop();
      resolve(last);
    };
    let timer = 0;
    const begin = () => {
      if (!live.isOpen || timer) return;
      timer = setTimeout(finish, LONGEST_MS);
    };
    live.addEventListener("state", begin);
    begin();
    const stop = live.watch(view, args, (data) => {
      last = data;
      if (isEnough(data)) setTimeout(finish);
    }, () => {});
  });
}

// Returns a promise of the place of the Overview; null if no transforms arrive and `isSure` is false.
async function robotPlace(isSure) {
  const [{ packed }, { robotLayout, sceneState }] = await Promise.all([import("./scene/link.js"), import("./panels/robot_layout.js")]);
  const { topics = [] } = await firstOf("running_topics", {}, () => true) ?? {};
  const hasTransforms = topics.some(({ name, publishers }) => TRANSFORMS.includes(name) && publishers.length);
  if (!hasTransforms && !isSure) return null;
  const [found, robot] = await Promise.all([hasTransforms ? firstOf("frames", {}, ({ frames }) => frames?.length > 0) : null,
    firstOf("scene_robot", { name: "robot_description" }, () => true)]);
  if (!found?.frames?.length && !isSure) return null;
  const state = sceneState(topics, found?.frames ?? [], Boolean(robot?.links));
  return placeOf("panels", robotLayout(topics, await packed(JSON.stringify(state))));
}

// Returns the link in the head that opens the Overview: the layout for the robot that runs.
export function robotLink() {
  const link = h("a", { href: "#panels", id: "robot", title: "Scene, cameras, plot and console side by side (h)",
    "aria-keyshortcuts": "h",
    onclick: async (event) => {
      event.preventDefault();
      link.setAttribute("aria-busy", "true");
      location.hash = await robotPlace(true);
      link.removeAttribute("aria-busy");
    } }, "Overview");
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
