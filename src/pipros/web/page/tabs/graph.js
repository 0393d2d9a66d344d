// The graph: pan with the mouse or arrow keys, zoom with the wheel or + and -, 0 fits everything, / searches.

import { live } from "../live.js";
import { bandwidth, download, h, hertz, replace, s } from "../dom.js";
import { topicPanel } from "../topic_panel.js";
import { placeOf } from "../place.js";

const MODES = [["active", "Nodes/Topics (active)"], ["all", "Nodes/Topics (all)"], ["nodes", "Nodes only"]];
const HIDDEN = [
  ["hide_dead_sinks", "Dead sinks"],
  ["hide_leaf_topics", "Leaf topics"],
  ["hide_debug", "Debug"],
  ["hide_tf", "tf"],
  ["hide_unreachable", "Unreachable"],
  ["hide_parameters", "Params"],
];
const FAR_SCALE = 3;
const NOTHING = "Nothing to show: no node is connected to another one, or everything is hidden.";
const KEEP = "pipros.graph.options";
const INITIAL = { mode: "active", nodes: "/", topics: "/", hide_dead_sinks: true, hide_leaf_topics: true, hide_debug: true, hide_tf: false, hide_unreachable: false, hide_parameters: false };

function keptOptions() {
  try {
    const kept = JSON.parse(localStorage.getItem(KEEP) ?? "{}");
    return Object.fromEntries(Object.entries(INITIAL).map(([name, value]) => [name, typeof kept[name] === typeof value ? kept[name] : value]));
  } catch {
    return { ...INITIAL };
  }
}

export function open(view, argument) {
  const options = keptOptions();
  const layer = s("g", {});
  const head = s("marker", { id: "head", viewBox: "0 0 8 8", refX: 7.5, refY: 4, markerWidth: 8, markerHeight: 8, orient: "auto" },
    s("path", { class: "head", d: "M0,0.5 L8,4 L0,7.5 Z" }));
  const canvas = s("svg", { class: "canvas", tabindex: 0, role: "application", "aria-label": "Graph of nodes and topics" }, s("defs", {}, head), layer);
  const error = h("div", { class: "error", role: "alert" });
  const counts = h("span", { class: "pale" });
  const side = h("aside", { hidden: true, tabindex: 0, "aria-label": "Selection" });
  const search = h("input", { type: "search", placeholder: "Search (/)", "aria-label": "Search nodes and topics", oninput: () => mark() });
  const empty = h("div", { class: "note", hidden: true, role: "status" }, NOTHING);
  view.append(h("div", { class: "column graph" }, toolbar(), error, empty, h("div", { class: "stage" }, canvas, corner())), side);

  let scene = null;
  let traffic = [];
  let selected = argument || null; // the key of a vertex: n/node or t/topic
  let box = { x: 0, y: 0, w: 100, h: 100 };
  let hasFitted = false;
  let vertices = new Map();
  let links = [];
  let closePanel = () => {};
  let closeView = () => {};
  look();

  function toolbar() {
    const change = (name, value) => {
      options[name] = value;
      localStorage.setItem(KEEP, JSON.stringify(options));
      hasFitted = false;
      look();
    };
    const text = (name, label) => h("label", {}, label, h("input", { value: options[name], size: 10, spellcheck: "false", title: "Names separated by commas; * stands for anything, - in front excludes", onchange: (event) => change(name, event.target.value) }));
    return h("div", { class: "bar" },
      h("select", { "aria-label": "What is shown", onchange: (event) => change("mode", event.target.value) },
        MODES.map(([value, title]) => h("option", { value, selected: value === options.mode }, title))),
      text("nodes", "Nodes"), text("topics", "Topics"),
      h("span", { class: "choices", role: "group", "aria-label": "Hide" }, "Hide:", HIDDEN.map(([name, title]) => h("label", {},
        h("input", { type: "checkbox", checked: options[name], onchange: (event) => change(name, event.target.checked) }), title))),
      search);
  }

  function corner() {
    return h("div", { class: "corner" }, counts, h("button", { title: "Fit the whole graph (0)", onclick: () => fit() }, "Fit"),
      h("span", { class: "buttons", role: "group", "aria-label": "Save the picture" }, ["svg", "png", "dot"].map((format) => h("button", { title: `Save as ${format.toUpperCase()}`, onclick: () => save(format) }, format.toUpperCase()))));
  }

  function look() {
    closeView();
    closeView = live.watch("graph", options, (data) => {
      if (data.scene) {
        draw(data.scene);
        empty.hidden = data.scene.boxes.length > 0;
        replace(empty, data.too_many ? `${data.too_many} nodes and topics match, and at most ${data.most} are drawn. Narrow the filters Nodes and Topics, or show nodes only.` : NOTHING);
      }
      else {
        traffic = data.traffic;
        label();
        replace(error, data.error ? `The master does not answer: ${data.error}` : "");
        replace(counts, `${data.nodes} nodes, ${data.topics} topics`);
      }
    }, (text) => replace(error, text));
  }

  function draw(next) {
    scene = next;
    const old = vertices;
    vertices = new Map();
    const bands = scene.bands.map((band) => s("g", {},
      s("rect", { class: "band", x: band.x - band.w / 2, y: band.y - band.h / 2, width: band.w, height: band.h, rx: 8 }),
      s("text", { class: "name", x: band.x - band.w / 2 + 8, y: band.y - band.h / 2 + 14 }, band.name)));
    links = scene.arrows.map((arrow) => {
      const text = s("text", { class: "name", x: arrow.middle[0], y: arrow.middle[1] - 5, "text-anchor": "middle" }, arrow.text);
      const line = s("g", { class: "link" }, s("path", { class: "arrow", d: arrow.path, "marker-end": "url(#head)" }));
      return { arrow, text, parts: [line, s("g", { class: "link" }, text)] };
    });
    for (const vertex of scene.boxes) {
      const group = vertexElement(vertex);
      const before = old.get(vertex.key)?.vertex;
      group.style.transform = `translate(${(before ?? vertex).x}px, ${(before ?? vertex).y}px)`;
      vertices.set(vertex.key, { vertex, group });
    }
    layer.replaceChildren(...bands, ...links.map((link) => link.parts[0]), ...links.map((link) => link.parts[1]), ...[...vertices.values()].map(({ group }) => group));
    requestAnimationFrame(() => {
      for (const { vertex, group } of vertices.values()) group.style.transform = `translate(${vertex.x}px, ${vertex.y}px)`;
    });
    if (!hasFitted) fit();
    if (selected) select(selected, false);
    label();
    mark();
  }

  function vertexElement(vertex) {
    const name = vertex.reachable ? vertex.kind : `${vertex.kind} unreachable`;
    const shape = vertex.kind === "node"
      ? s("ellipse", { class: name, rx: vertex.w / 2, ry: vertex.h / 2 })
      : s("rect", { class: name, x: -vertex.w / 2, y: -vertex.h / 2, width: vertex.w, height: vertex.h, rx: 3 });
    return s("g", {
      class: "vertex", tabindex: 0, role: "button", "data-key": vertex.key,
      "aria-label": `${vertex.kind} ${vertex.name}${vertex.reachable ? "" : ", does not answer"}`,
      onclick: () => select(vertex.key, true),
      onkeydown: (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); select(vertex.key, true); } },
    }, shape, s("text", { "text-anchor": "middle", "dominant-baseline": "central" }, vertex.text), s("title", {}, vertex.name));
  }

  function label() {
    links.forEach(({ arrow, text }, index) => {
      const values = traffic[index];
      const measured = values ? `${hertz(values[0])} · ${bandwidth(values[1])}` : "";
      const shown = [arrow.text, arrow.start.startsWith("t") && !arrow.text ? "" : measured].filter(Boolean).join("  ");
      if (text.textContent !== shown) text.textContent = shown;
    });
  }

  function mark() {
    const wanted = search.value.trim().toLowerCase();
    for (const { vertex, group } of vertices.values()) {
      group.classList.toggle("found", wanted !== "" && vertex.name.toLowerCase().includes(wanted));
    }
  }

  function select(key, isByUser) {
    const isSame = isByUser && key === selected;
    selected = isSame ? null : key;
    if (isByUser) history.replaceState(null, "", placeOf("graph", selected ?? ""));
    const near = new Set([selected]);
    for (const { arrow, parts } of links) {
      const touches = arrow.start === selected || arrow.end === selected;
      for (const part of parts) part.classList.toggle("near", touches);
      if (touches) near.add(arrow.start).add(arrow.end);
    }
    for (const [other, { group }] of vertices) {
      group.classList.toggle("near", near.has(other));
      group.classList.toggle("selected", other === selected);
    }
    canvas.classList.toggle("chosen", selected !== null && vertices.has(selected));
    if (isByUser || side.hidden) showSide();
  }

  function showSide() {
    closePanel();
    closePanel = () => {};
    side.hidden = selected === null;
    side.replaceChildren();
    if (selected === null) return;
    if (selected.startsWith("t")) closePanel = topicPanel(side, selected.slice(1));
    else closePanel = nodePanel(side, selected.slice(1));
  }

  // Pan and zoom ------------------------------------------------------------------------------------------------------

  function setBox(next) {
    box = next;
    canvas.setAttribute("viewBox", `${box.x} ${box.y} ${box.w} ${box.h}`);
    canvas.classList.toggle("far", scaleNow() > FAR_SCALE); // labels are unreadable at this scale, and most of the work of drawing
  }

  function fit() {
    if (!scene) return;
    const { width, height } = canvas.getBoundingClientRect();
    if (!width || !height) return;
    hasFitted = true;
    const scale = Math.min(1.6, width / scene.width, height / scene.height);
    setBox({ x: scene.width / 2 - width / scale / 2, y: scene.height / 2 - height / scale / 2, w: width / scale, h: height / scale });
  }

  function zoom(factor, at = { x: box.x + box.w / 2, y: box.y + box.h / 2 }) {
    setBox({ x: at.x - (at.x - box.x) * factor, y: at.y - (at.y - box.y) * factor, w: box.w * factor, h: box.h * factor });
  }

  function scaleNow() {
    return box.w / (canvas.clientWidth || 1);
  }

  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const bounds = canvas.getBoundingClientRect();
    zoom(1.0015 ** event.deltaY, { x: box.x + (event.clientX - bounds.left) * scaleNow(), y: box.y + (event.clientY - bounds.top) * scaleNow() });
  }, { passive: false });
  let drag = null;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.target.closest(".vertex")) return;
    drag = { x: event.clientX, y: event.clientY, box };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (drag) setBox({ ...box, x: drag.box.x - (event.clientX - drag.x) * scaleNow(), y: drag.box.y - (event.clientY - drag.y) * scaleNow() });
  });
  canvas.addEventListener("pointerup", () => { drag = null; });
  const onKey = (event) => {
    if (event.target.matches("input, select")) return;
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (steps && canvas.contains(event.target)) setBox({ ...box, x: box.x + steps[0] * box.w * .1, y: box.y + steps[1] * box.h * .1 });
    else if (event.key === "+" || event.key === "=") zoom(1 / 1.25);
    else if (event.key === "-") zoom(1.25);
    else if (event.key === "0") fit();
    else if (event.key === "/") search.focus();
    else if (event.key === "Escape" && selected) select(selected, true);
    else return;
    event.preventDefault();
  };
  document.addEventListener("keydown", onKey);
  const resized = new ResizeObserver(() => { if (hasFitted || scene) fit(); });
  resized.observe(canvas);

  // Image files -------------------------------------------------------------------------------------------------------

  async function save(format) {
    try {
      const text = await live.act("picture", { ...options, format: format === "dot" ? "dot" : "svg" });
      if (format !== "png") download(`rqt_graph.${format}`, text, format === "svg" ? "image/svg+xml" : "text/vnd.graphviz");
      else download("rqt_graph.png", await asPng(text));
    } catch (problem) {
      replace(error, problem.message);
    }
  }

  return () => {
    closeView();
    closePanel();
    resized.disconnect();
    document.removeEventListener("keydown", onKey);
  };
}

async function asPng(svg) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = h("canvas", { width: image.width * 2, height: image.height * 2 });
  const context = canvas.getContext("2d");
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => { canvas.toBlob(resolve, "image/png"); });
}

function nodePanel(side, name) {
  const body = h("div", {});
  side.append(h("h2", {}, name), body);
  const list = (title, entries) => [h("h3", {}, title), entries.length ? h("ul", { class: "tree" }, entries.map((entry) => h("li", {}, entry))) : h("span", { class: "key" }, "none")];
  const topic = ([topicName, type]) => [h("a", { href: placeOf("topics", topicName) }, topicName), ` ${type}`];
  return live.watch("node", { name }, (node) => {
    if (body.contains(document.activeElement)) return;
    replace(body,
      node.known ? null : h("p", { class: "error" }, "The master no longer knows this node."),
      node.error ? h("p", { class: "error" }, `Does not answer: ${node.error}`) : null,
      h("dl", {}, h("dt", {}, "URI"), h("dd", {}, node.uri || "–")),
      list("Publications", node.publications.map(topic)),
      list("Subscriptions", node.subscriptions.map(topic)),
      list("Services", node.services),
      list("Parameters", node.parameters.map(([key, value]) => [h("span", { class: "key" }, `${key}: `), value])),
      list("Connections", node.connections.map(([from, over, to, rate, size]) => `${from === name ? `to ${to}` : `from ${from}`}, ${over}: ${hertz(rate)}, ${bandwidth(size)}`)));
  });
}
