// The file that a scene shows, and the address that contains what the user changed since it was loaded.

import { robotScene } from "../home.js";
import { placeOf } from "../place.js";
import { packed, stateText, withLink } from "./link.js";

const ADDRESS_MS = 1000;
const DEFAULT = [{ Class: "rviz/Grid", Name: "Grid", Enabled: "true" }, { Class: "rviz/TF", Name: "TF", Enabled: "true" }];

// Loads the file that the server sends, and again each one that it sends later. `link` is the argument in the address.
// `on.file(data)` is called with a file, `on.load(config)` after the scene shows a configuration, `on.problem(text)` with an error,
// or "" at the beginning of an attempt to load.
export function loadedFile(scene, link, context, on) {
  let file = null; // as the server sent it
  let shownState = "";

  function load(config, fixedFrame) {
    scene.load(config, fixedFrame, file.simulated);
    shownState = stateText(scene.file);
    on.load(config);
  }

  async function show() {
    on.problem("");
    const config = structuredClone(Object.keys(file.config).length ? file.config : { "Visualization Manager": { Displays: DEFAULT } });
    if (link) {
      try {
        load(await withLink(config, link), "");
        return;
      } catch (problem) {
        on.problem(problem.message);
      }
    }
    load(config, file.fixed_frame);
    if (!Object.keys(file.config).length) await showRobot();
  }

  // Without a file, shows the robot and what it sees, unless the user has changed something meanwhile.
  async function showRobot() {
    const begun = shownState;
    const found = await robotScene(false);
    if (!found || link || context.signal.aborted || stateText(scene.file) !== begun) return;
    load(await withLink({}, found.link), file.fixed_frame);
  }

  // Keeps the address up to date. A file that is loaded later replaces the changes.
  async function noteAddress() {
    if (!file || !scene.file) return;
    const state = stateText(scene.file);
    if (state === shownState) return;
    shownState = state;
    link = await packed(state) ?? "";
    context.remember(link, { isReplacing: true });
  }

  const noting = setInterval(noteAddress, ADDRESS_MS);
  context.signal.addEventListener("abort", () => clearInterval(noting));

  context.watch("scene_config", {}, (data) => {
    if (JSON.stringify(data) === JSON.stringify(file)) return; // sent again after a lost connection
    if (file) {
      link = "";
      context.remember("", { isReplacing: true });
    }
    file = data;
    on.file(data);
    show();
  }, on.problem, { always: true });

  return {
    // Saves the scene on the server. Returns a promise of the path.
    async save() {
      const saved = structuredClone(scene.file);
      const path = await context.act("scene_save", { config: saved });
      file.config = saved;
      return path;
    },

    async address() {
      await noteAddress();
      const text = await packed(stateText(scene.file));
      if (text === null) throw new Error("the scene is too large for a link");
      return `${location.href.split("#")[0]}${placeOf("scene", text)}`;
    },

    go(next) {
      link = next;
      if (file) show();
    },
  };
}
