// Where the page begins if its address names no view: at the last place; the first time, at the Overview, or at the
// graph if there are no transforms.

import { live } from "./live.js";
import { robotLayout, sceneState } from "./panels/robot_layout.js";
import { currentPlace, placeOf } from "./place.js";
import { packed } from "./scene/link.js";

const KEEP = "pipros.last";
export const LAYOUT = "pipros.panels";
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
    const begin = () => { if (live.isOpen) timer ||= setTimeout(finish, LONGEST_MS); };
    live.addEventListener("state", begin);
    begin();
    const stop = live.watch(view, args, (data) => {
      last = data;
      if (isEnough(data)) setTimeout(finish);
    }, () => {});
  });
}

// Returns a promise of {topics, link}, with the link of the scene of the robot that runs; null if no transforms arrive and `isSure` is
// false.
export async function robotScene(isSure, onFound = () => {}) {
  const { topics = [] } = await firstOf("running_topics", {}, () => true) ?? {};
  const hasTransforms = topics.some(({ name, publishers }) => TRANSFORMS.includes(name) && publishers.length);
  if (!hasTransforms && !isSure) return null;
  onFound();
  const [found, robot] = await Promise.all([hasTransforms ? firstOf("frames", {}, ({ frames }) => frames?.length > 0) : null,
    firstOf("scene_robot", { name: "robot_description" }, () => true)]);
  if (!found?.frames?.length && !isSure) return null;
  const state = sceneState(topics, found?.frames ?? [], Boolean(robot?.links));
  return { topics, link: await packed(JSON.stringify(state)) };
}

// Returns a promise of the place of the Overview; null if there is no scene.
async function robotPlace(isSure, onFound) {
  const found = await robotScene(isSure, onFound);
  return found && placeOf("panels", robotLayout(found.topics, found.link));
}

// Makes a link open the Overview: the layout of the last time or, if there is none or it is open already, that for the robot that runs.
export function robotLink(link) {
  link.title = "Views side by side (h); again: scene, cameras, plot and console of the robot that runs";
  link.setAttribute("aria-keyshortcuts", "h");
  link.addEventListener("click", async (event) => {
    const hasLayout = localStorage.getItem(LAYOUT) || link.hash !== placeOf("panels");
    if (hasLayout && currentPlace()[0] !== "panels") return;
    event.preventDefault();
    link.setAttribute("aria-busy", "true");
    location.hash = await robotPlace(true);
    link.removeAttribute("aria-busy");
  });
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

// Goes to the first place if the address names none. Returns whether it does so. `onScene` is called as soon as that will have a scene.
export function goHome(onScene) {
  if (currentPlace()[0]) return false;
  let last = "";
  try {
    last = localStorage.getItem(KEEP) ?? "";
  } catch {
    // the browser denies storage to this page
  }
  const go = (place) => { if (!currentPlace()[0]) location.replace(place); };
  if (last.length > 1) go(last);
  else robotPlace(false, onScene).then((place) => go(place ?? placeOf("graph")));
  return true;
}
