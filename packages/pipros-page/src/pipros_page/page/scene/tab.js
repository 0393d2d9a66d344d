// The Scene tab: a tree of displays, a toolbar, and the picture.

import { copyButton } from "../copy.js";
import { download, h, problemLine } from "../dom.js";
import { budgetLine } from "./budget.js";
import { loadedFile } from "./loaded_file.js";
import { Scene } from "./scene.js";
import { Tools } from "./tools.js";
import { TreePanel } from "./tree_panel.js";
import { VIEWS } from "./schema.js";
import { toolbar } from "../toolbar.js";

const STATUS_MS = 500;

export function open(view, argument, context) {
  const canvas = h("canvas", { class: "scene-canvas", tabindex: 0, role: "img", "aria-label": "Scene" });
  const error = problemLine();
  const status = h("div", { class: "scene-status", role: "status" });
  const images = h("div", { class: "scene-images" });
  const lost = h("div", { class: "scene-lost", hidden: true }, "The graphics card was reset; the picture returns when it is ready.");
  let scene;
  try {
    scene = new Scene(context, canvas, () => showStatus());
  } catch (problem) {
    error.show(`The scene needs WebGL 2, which this browser does not provide: ${problem.message}`);
    view.append(h("div", { class: "column" }, error.element));
    return {};
  }
  scene.images = images;
  const tools = new Tools(scene, canvas, status, context);
  const tree = new TreePanel(scene, context);
  const kinds = viewChoice(scene);
  const save = h("button", { onclick: () => keep(), disabled: !context.control }, "Save");
  const dock = h("button", { "aria-pressed": "true", onclick: () => {
    tree.element.hidden = !tree.element.hidden;
    dock.setAttribute("aria-pressed", String(!tree.element.hidden));
  } }, "Displays");
  // Until the configuration has arrived, there is nothing that a control could change.
  const column = h("div", { class: "column scene-loading" },
    toolbar({ title: "Scene", class: "scene-bar" }, dock, tools.element, h("span", { class: "spring" }), kinds,
      h("button", { onclick: () => scene.view.home() }, "Zero"),
      h("button", { onclick: () => scene.reset() }, "Reset"),
      h("button", { onclick: () => savePicture(scene, canvas) }, "Save PNG"),
      copyButton("Link", () => file.address(), error.show), save),
    error.element,
    h("div", { class: "scene" }, tree.element, h("div", { class: "scene-stage" }, canvas, tools.rectangle.element, images,
      tools.selection.element, lost, status, budgetLine(scene, context.signal))));
  view.append(column);
  if (innerWidth < 700) dock.click();

  const keep = () => error.attempt(async () => tools.say(`saved as ${await file.save()}`));

  let pending = 0;
  function showStatus() {
    lost.hidden = !scene.isLost;
    pending ||= setTimeout(() => {
      pending = 0;
      tree.showStatus();
    }, STATUS_MS);
  }

  const file = loadedFile(scene, argument, context, {
    problem: error.show,
    file: ({ path }) => { save.title = context.control ? `Save as ${path}` : "Saving needs --control"; },
    load: (config) => {
      column.classList.remove("scene-loading");
      kinds.value = kindOf(scene);
      tools.load();
      tree.load();
      const geometry = config["Window Geometry"];
      if (geometry?.["Hide Left Dock"] === "true" && !tree.element.hidden) dock.click();
    },
  });
  drawWhileVisible(scene, canvas, context.signal);
  view.scene = scene; // for tests
  return { go: (next) => file.go(next) };
}

function viewChoice(scene) {
  const kinds = h("select", { "aria-label": "View", onchange: () => {
    const old = scene.config.Views.Current;
    scene.setView({ ...old, Class: kinds.value, Name: "Current View", Value: `${kinds.value.slice(5)} (rviz)` });
  } }, Object.keys(VIEWS).map((kind) => h("option", { value: kind }, kind.slice(5))));
  return kinds;
}

const kindOf = (scene) => Object.keys(VIEWS).find((kind) =>
  kind.slice(5) === (scene.config.Views.Current.Class ?? "").split("/").at(-1)) ?? "rviz/Orbit";

function savePicture(scene, canvas) {
  scene.draw();
  canvas.toBlob((blob) => download("scene.png", blob));
}

// Draws the scene only while its canvas can be seen, and until `signal` is aborted.
function drawWhileVisible(scene, canvas, signal) {
  signal.addEventListener("abort", () => {
    scene.hide();
    scene.close();
  });
  const seen = new IntersectionObserver(([entry]) => (entry.isIntersecting ? scene.show() : scene.hide()));
  seen.observe(canvas);
  new ResizeObserver(() => scene.invalidate()).observe(canvas);
}
