// Asks before the page acts on the running system while its tabs show a bag or the past. Refuses to act while the server is silent: it
// would act long afterwards.

import { h, replace } from "../dom.js";
import { live } from "../live.js";
import { silence } from "../silence.js";
import { playback } from "./playback.js";

// Acts that stop a robot or change only files need no confirmation.
const UNASKED = new Set(["cancel_goal", "record", "scene_save", "stop_recording"]);

const agreed = new Set(); // kinds of acts that the user has agreed to while this bag is open
let asking = "";
let shown = null; // the bag that is shown

const question = h("p", {});
const act = h("button", { value: "yes" }, "Act on the robot");
const dialog = h("dialog", { class: "ask-first", "aria-label": "Act on the robot?" },
  h("form", { method: "dialog" }, h("h2", {}, "The tabs do not show the robot as it is now"), question,
    h("div", { class: "answers" }, h("button", { value: "no", autofocus: true }, "Cancel"), act)));

// Returns a promise that is rejected if the user declines or another question is open; null if there is nothing to ask.
// `kinds` are what views and actions can do, such as "send goals".
function ask(name, kinds) {
  const kind = kinds[name];
  if (!kind || UNASKED.has(name)) return null;
  if (silence.seconds) return Promise.reject(new Error(`not done: ${live.problem()}`));
  if (!playback.bag || agreed.has(kind)) return null;
  const source = playback.bag.rewind ? "the past" : `the bag ${playback.name}`;
  const declined = new Error(`not done, because the tabs show ${source}`);
  if (asking) return Promise.reject(declined);
  asking = kind;
  replace(question, `They show ${source}. Really ${kind} now? If you agree, you are not asked about this again until you leave ${source}.`);
  dialog.returnValue = "no"; // Escape
  dialog.showModal();
  return new Promise((resolve, reject) => {
    dialog.addEventListener("close", () => {
      asking = "";
      if (dialog.returnValue !== "yes") { reject(declined); return; }
      agreed.add(kind);
      resolve();
    }, { once: true });
  });
}

// Asks before requests. `kinds` is called for each, and returns what views and actions can do.
export function askFirst(kinds) {
  document.body.append(dialog);
  live.ask = (name) => ask(name, kinds());
  playback.addEventListener("change", () => {
    if (playback.bag !== shown) agreed.clear();
    shown = playback.bag;
  });
}
