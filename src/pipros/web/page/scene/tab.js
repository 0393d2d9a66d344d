// The Scene tab: a tree of displays, a toolbar, and the picture.

import { copyButton } from "../copy.js";
import { download, h, replace } from "../dom.js";
import { placeOf } from "../place.js";
import { budgetLine } from "./budget.js";
import { packed, stateText, withLink } from "./link.js";
import { Scene } from "./scene.js";
import { Tools } from "./tools.js";
import { TreePanel } from "./tree_panel.js";
import { VIEWS } from "./schema.js";

const STATUS_MS = 500;
const ADDRESS_MS = 1000;
const DEFAULT = [{ Class: "rviz/Grid", Name: "Grid", Enabled: "true" }, { Class: "rviz/TF", Name: "TF", Enabled: "true" }];

export function open(view, argument, context) {
  const canvas = h("canvas", { class: "scene-canvas", tabindex: 0, role: "img", "aria-label": "Scene" });
  const error = h("div", { class: "error", role: "alert" });
  const status = h("div", { class: "scene-status", role: "status" });
  const images = h("div", { class: "scene-images" });
  const lost = h("div", { class: "scene-lost", hidden: true }, "The graphics card was reset; the picture returns when it is ready.");
  let path = "";
  let scene;
  try {
    scene = new Scene(context, canvas, () => showStatus());
  } catch (problem) {
    replace(error, `The scene needs WebGL 2, which this browser does not provide: ${problem.message}`);
    view.append(h("div", { class: "column" }, error));
    return {};
  }
  scene.images = images;
  const tools = new Tools(scene, canvas, status, context);
  const tree = new TreePanel(scene, context);
  const kinds = h("select", { "aria-label": "View", onchange: () => {
    const old = scene.config.Views.Current;
    scene.setView({ ...old, Class: kinds.value, Name: "Current View", Value: `${kinds.value.slice(5)} (rviz)` });
  } }, Object.keys(VIEWS).map((kind) => h("option", { value: kind }, kind.slice(5))));
  const save = h("button", { onclick: () => keep(), disabled: !context.control }, "Save");
  const dock = h("button", { "aria-pressed": "true", onclick: () => {
    tree.element.hidden = !tree.element.hidden;
    dock.setAttribute("aria-pressed", String(!tree.element.hidden));
  } }, "Displays");
  view.append(h("div", { class: "column" },
    h("div", { class: "bar scene-bar" }, dock, tools.element, h("span", { class: "spring" }), kinds,
      h("button", { onclick: () => scene.view.home() }, "Zero"),
      h("button", { onclick: () => scene.reset() }, "Reset"),
      h("button", { onclick: () => picture() }, "Save PNG"),
      copyButton("Link", address, (text) => replace(error, text)), save),
    error,
    h("div", { class: "scene" }, tree.element, h("div", { class: "scene-stage" }, canvas, tools.rectangle.element, images,
      tools.selection.element, lost, status, budgetLine(scene, context.signal)))));
  if (innerWidth < 700) dock.click();

  function picture() {
    scene.draw();
    canvas.toBlob((blob) => download("scene.png", blob));
  }

  async function keep() {
    try {
      const saved = structuredClone(scene.file);
      tools.say(`saved as ${await context.act("scene_save", { config: saved })}`);
      file.config = saved;
    } catch (problem) {
      replace(error, problem.message);
    }
  }

  let pending = 0;
  function showStatus() {
    lost.hidden = !scene.isLost;
    pending ||= setTimeout(() => {
      pending = 0;
      tree.showStatus();
    }, STATUS_MS);
  }

  // The address contains what differs from the file. A file that is loaded later replaces it.
  let file = null; // as the server sent it
  let link = argument;
  let shownState = "";

  function load(config, fixedFrame) {
    scene.load(config, fixedFrame, file.simulated);
    shownState = stateText(scene.file);
    kinds.value = Object.keys(VIEWS).find((kind) => kind.slice(5) === (scene.config.Views.Current.Class ?? "").split("/").at(-1))
      ?? "rviz/Orbit";
    tools.load();
    tree.load();
    const geometry = config["Window Geometry"];
    if (geometry?.["Hide Left Dock"] === "true" && !tree.element.hidden) dock.click();
  }

  async function loadFile() {
    replace(error);
    const config = structuredClone(Object.keys(file.config).length ? file.config : { "Visualization Manager": { Displays: DEFAULT } });
    if (link) {
      try {
        load(await withLink(config, link), "");
        return;
      } catch (problem) {
        replace(error, problem.message);
      }
    }
    load(config, file.fixed_frame);
  }

  async function noteAddress() {
    if (!file || !scene.file) return;
    const state = stateText(scene.file);
    if (state === shownState) return;
    shownState = state;
    link = await packed(state) ?? "";
    context.remember(link, { isReplacing: true });
  }

  async function address() {
    await noteAddress();
    const text = await packed(stateText(scene.file));
    if (text === null) throw new Error("the scene is too large for a link");
    return `${location.href.split("#")[0]}${placeOf("scene", text)}`;
  }

  const noting = setInterval(noteAddress, ADDRESS_MS);
  context.signal.addEventListener("abort", () => {
    clearInterval(noting);
    scene.hide();
    scene.close();
  });

  context.watch("scene_config", {}, (data) => {
    if (JSON.stringify(data) === JSON.stringify(file)) return; // sent again after a lost connection
    if (file) {
      link = "";
      context.remember("", { isReplacing: true });
    }
    file = data;
    path = data.path;
    save.title = context.control ? `Save as ${path}` : "Saving needs --control";
    loadFile();
  }, (problem) => replace(error, problem), { always: true });

  const seen = new IntersectionObserver(([entry]) => (entry.isIntersecting ? scene.show() : scene.hide()));
  seen.observe(canvas);
  new ResizeObserver(() => scene.invalidate()).observe(canvas);
  view.scene = scene; // for tests
  return { go: (next) => {
    link = next;
    if (file) loadFile();
  } };
}
