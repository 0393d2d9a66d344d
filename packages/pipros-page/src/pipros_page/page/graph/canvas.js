// A drawing of a graph: pan by mouse, finger or arrow keys, zoom by wheel, two fingers or + and -, 0 fits everything.
// Shared by the Graph and TF tabs.

import { h, s } from "../dom.js";

const FAR_SCALE = 3; // units per pixel beyond which the heads of arrows are hidden, and the names of more than MANY boxes
const MANY = 500;
const FONT = 13; // units, as in page.css; boxes grow with their names so that these have at least LEAST pixels, as far as there is room
const LEAST = 11;
const LARGEST_GROWTH = 1.4;
const CROWDED_SCALE = 1.6; // units per pixel beyond which rates are hidden
const narrow = matchMedia("(max-width: 900px)"); // there, `fit` leaves all names, and the rest is reached by dragging
const LARGEST_SCALE = 1.15; // pixels per unit after `fit`
const ZOOM_STEP = 1.25;
const PAN_STEP = 0.1;
const CORNER_GAP_PX = 13;
const LETTER = 6.3; // width of a letter of a label
const PLATE = 14; // height of the plate of a label
const HEAD = "M0,0.5 L8,4 L0,7.5 Z";

// The text that stands for a vertex in addresses and attributes: node:/talker.
const keyText = ({ kind, name }) => `${kind}:${name}`;

// Returns by how much boxes can grow before two of them nearly touch.
function roomOf(boxes) {
  if (boxes.length > MANY) return 1;
  const least = boxes.map((one, index) => boxes.slice(index + 1).reduce((room, other) => Math.min(room,
    Math.max(Math.abs(one.x - other.x) / (one.w + other.w), Math.abs(one.y - other.y) / (one.h + other.h)) * 1.9), LARGEST_GROWTH));
  return Math.max(1, Math.min(LARGEST_GROWTH, ...least));
}

// Returns a canvas whose `onSelect` is called with the key of a vertex that the user chose.
export function graphCanvas(label, onSelect) {
  const layer = s("g", {});
  const markers = ["head", "wrong-head"].map((id) => s("marker",
    { id, viewBox: "0 0 8 8", refX: 7.5, refY: 4, markerWidth: 11, markerHeight: 11, markerUnits: "userSpaceOnUse",
      orient: "auto" }, s("path", { class: id, d: HEAD })));
  const element = s("svg", { class: "canvas", tabindex: 0, role: "application", "aria-label": label,
    "data-keys": "arrows: move the focused drawing; Enter selects a focused box" }, s("defs", {}, markers), layer);
  let scene = null;
  let box = { x: 0, y: 0, w: 100, h: 100 };
  let isMoved = false; // by the user; then changes of the graph and of the window's size keep the view
  let vertices = new Map(); // key text to {vertex, group}
  let links = []; // {arrow, text, parts}
  let room = 1; // by how much boxes can grow

  function draw(next) {
    scene = next;
    room = roomOf(scene.boxes);
    const old = vertices;
    vertices = new Map();
    element.classList.toggle("many", scene.boxes.length > MANY);
    const bands = scene.bands.map(bandElement);
    links = scene.arrows.map(linkElements);
    for (const vertex of scene.boxes) {
      const key = keyText(vertex);
      const group = vertexElement(vertex, key);
      const before = old.get(key)?.vertex ?? vertex;
      group.style.transform = `translate(${before.x}px, ${before.y}px)`;
      vertices.set(key, { vertex, group });
    }
    const groups = [...vertices.values()].map(({ group }) => group);
    const focused = layer.contains(document.activeElement) ? document.activeElement.getAttribute("data-key") : null;
    layer.replaceChildren(...bands, ...links.map(({ parts }) => parts[0]), ...links.map(({ parts }) => parts[1]), ...groups);
    vertices.get(focused)?.group.focus({ preventScroll: true });
    requestAnimationFrame(() => {
      for (const { vertex, group } of vertices.values()) group.style.transform = `translate(${vertex.x}px, ${vertex.y}px)`;
    });
    if (!isMoved) fit();
  }

  function vertexElement(vertex, key) {
    const shapeClass = `${vertex.kind}${vertex.reachable ? "" : " unreachable"}${vertex.gone ? " gone" : ""}`;
    const shape = vertex.kind === "node"
      ? s("ellipse", { class: shapeClass, rx: vertex.w / 2, ry: vertex.h / 2 })
      : s("rect", { class: shapeClass, x: -vertex.w / 2, y: -vertex.h / 2, width: vertex.w, height: vertex.h,
        rx: vertex.kind === "frame" ? 12 : 3 });
    const choose = () => onSelect(key);
    const state = vertex.gone ? ", gone" : vertex.reachable ? "" : ", does not answer";
    const group = s("g", {
      class: "vertex", tabindex: 0, role: "button", "data-key": key,
      "aria-label": `${vertex.kind} ${vertex.name}${state}`,
      onclick: choose,
      onkeydown: (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); choose(); } },
    }, shape, s("text", { "text-anchor": "middle", "dominant-baseline": "central" }, vertex.text),
    s("title", {}, [vertex.name, ...vertex.members].join("\n")),
      vertex.gone ? s("text", { class: "age", y: vertex.h / 2 + 15, "text-anchor": "middle" }) : null);
    const [, namespace, ...rest] = vertex.name.split("/");
    group.classList.toggle("tinted", rest.length > 0);
    if (rest.length) group.style.setProperty("--hue", String(hueOf(namespace)));
    return group;
  }

  // Shows how long ago vertices were removed: [{kind, name, age}] with ages in seconds.
  function showAges(removed) {
    for (const { kind, name, age } of removed) {
      const text = vertices.get(keyText({ kind, name }))?.group.querySelector("text.age");
      if (text) text.textContent = `gone ${age} s ago`;
    }
  }

  // Marks the vertices with these keys as stale, and no others.
  function markStale(keys) {
    for (const [key, { group }] of vertices) group.classList.toggle("stale", keys.includes(key));
  }

  const vertexOf = (key) => vertices.get(key)?.vertex;

  // Calls `textOf` and `lookOf` with each arrow and its index, shows the text, marks stale arrows, and sets the width of lines.
  function labelArrows(textOf, lookOf) {
    links.forEach(({ arrow, text, parts }, index) => {
      const shown = textOf(arrow, index);
      const { isStale, width } = lookOf(arrow, index);
      for (const part of parts) part.classList.toggle("stale", isStale);
      parts[0].style.setProperty("--width", width.toFixed(1));
      if (text.textContent === shown) return;
      text.textContent = shown;
      setPlate(text, shown);
    });
  }

  // Emphasises a vertex and its neighbours; null for none. Returns whether it is in the drawing.
  function emphasise(selected) {
    const near = new Set([selected]);
    for (const { arrow, parts } of links) {
      const [start, end] = [keyText(arrow.start), keyText(arrow.end)];
      const isNear = start === selected || end === selected;
      for (const part of parts) part.classList.toggle("near", isNear);
      if (isNear) near.add(start).add(end);
    }
    for (const [key, { group }] of vertices) {
      group.classList.toggle("near", near.has(key));
      group.classList.toggle("selected", key === selected);
    }
    element.classList.toggle("chosen", vertices.has(selected));
    return vertices.has(selected);
  }

  // Marks the vertices whose names contain a text, and returns their keys.
  function find(text) {
    const wanted = text.trim().toLowerCase();
    const found = [];
    for (const [key, { vertex, group }] of vertices) {
      const isFound = wanted !== "" && vertex.name.toLowerCase().includes(wanted);
      group.classList.toggle("found", isFound);
      if (isFound) found.push(key);
    }
    return found;
  }

  // Pan and zoom ------------------------------------------------------------------------------------------------------

  const unitsPerPixel = () => box.w / (element.clientWidth || 1);

  function setBox(next) {
    box = next;
    element.setAttribute("viewBox", `${box.x} ${box.y} ${box.w} ${box.h}`);
    const units = unitsPerPixel();
    element.classList.toggle("far", units > FAR_SCALE);
    element.classList.toggle("crowded", units > CROWDED_SCALE);
    element.style.setProperty("--box", String(growthAt(units)));
    element.style.setProperty("--small-label", `${LEAST * Math.max(1, units)}px`);
    element.style.setProperty("--grow", String(Math.max(1, units)));
  }

  const growthAt = (units) => Math.min(room, Math.max(1, (LEAST * units) / FONT));

  function fit() {
    isMoved = false;
    const { width, height, bottom } = element.getBoundingClientRect();
    if (!scene || !width || !height) return;
    const corner = element.parentElement.querySelector(".corner")?.getBoundingClientRect().top ?? bottom;
    const clear = Math.max(1, height - Math.max(0, bottom - corner) - CORNER_GAP_PX); // the buttons may lie over the rest
    const growth = growthAt(Math.max(scene.width / width, scene.height / clear));
    const sides = scene.boxes.flatMap(({ x, w }) => [x - (growth * w) / 2, x + (growth * w) / 2]);
    const [first, last] = [Math.min(0, ...sides), Math.max(scene.width, ...sides)];
    const whole = Math.min(LARGEST_SCALE, width / (last - first), clear / scene.height);
    const legible = LEAST / (FONT * room);
    const scale = narrow.matches ? Math.max(whole, 1 / CROWDED_SCALE, legible) : whole;
    const left = first + Math.min(last - first - width / scale, 0) / 2; // what is too wide or high begins at its left or top
    const top = Math.min(scene.height - clear / scale, 0) / 2;
    setBox({ x: left, y: top, w: width / scale, h: height / scale });
  }

  // Keeps the centre and the scale when the element's size changes.
  function resize() {
    const { width, height } = element.getBoundingClientRect();
    if (!isMoved || !width || !height) { fit(); return; }
    const scale = box.w / shownWidth;
    const next = { w: width * scale, h: height * scale };
    setBox({ ...next, x: box.x + (box.w - next.w) / 2, y: box.y + (box.h - next.h) / 2 });
  }

  function move(next) {
    isMoved = true;
    setBox(next);
  }

  function zoom(factor, at = { x: box.x + box.w / 2, y: box.y + box.h / 2 }) {
    move({ x: at.x - (at.x - box.x) * factor, y: at.y - (at.y - box.y) * factor, w: box.w * factor, h: box.h * factor });
  }

  function centre(key) {
    const found = vertices.get(key);
    if (found) move({ ...box, x: found.vertex.x - box.w / 2, y: found.vertex.y - box.h / 2 });
  }

  function positionOf({ clientX, clientY }) {
    const bounds = element.getBoundingClientRect();
    return { x: box.x + (clientX - bounds.left) * unitsPerPixel(), y: box.y + (clientY - bounds.top) * unitsPerPixel() };
  }

  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(1.0015 ** event.deltaY, positionOf(event));
  }, { passive: false });

  // One pointer drags; two also zoom, about the point between them.
  const pointers = new Map(); // id to the last event
  const middle = (all) => {
    const [first, second = first] = all;
    return { clientX: (first.clientX + second.clientX) / 2, clientY: (first.clientY + second.clientY) / 2 };
  };
  const spread = (all) => Math.hypot(all[0].clientX - all[1].clientX, all[0].clientY - all[1].clientY);
  element.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "mouse" && event.target.closest(".vertex")) return;
    pointers.set(event.pointerId, event);
    if (!event.target.closest(".vertex") || pointers.size === 2) element.setPointerCapture(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId) || pointers.size > 2) return;
    const before = [...pointers.values()];
    pointers.set(event.pointerId, event);
    const after = [...pointers.values()];
    const [from, to] = [positionOf(middle(before)), positionOf(middle(after))];
    move({ ...box, x: box.x + from.x - to.x, y: box.y + from.y - to.y });
    if (after.length === 2 && spread(after) > 0) zoom(spread(before) / spread(after), positionOf(middle(after)));
  });
  for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, (event) => pointers.delete(event.pointerId));

  // Handles a key. Returns whether the drawing uses it.
  function onKey(event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (steps && element.contains(event.target)) {
      move({ ...box, x: box.x + steps[0] * box.w * PAN_STEP, y: box.y + steps[1] * box.h * PAN_STEP });
      return true;
    }
    return false;
  }

  let shownWidth = 1;
  new ResizeObserver(() => {
    resize();
    shownWidth = element.clientWidth || shownWidth;
  }).observe(element);

  const zoomButtons = () => h("span", { class: "buttons", role: "group", "aria-label": "Zoom" },
    h("button", { "aria-label": "Zoom out", title: "Zoom out (-)", "aria-keyshortcuts": "-", onclick: () => zoom(ZOOM_STEP) }, "−"),
    h("button", { "aria-label": "Zoom in", title: "Zoom in (+)", "aria-keyshortcuts": "+ =", onclick: () => zoom(1 / ZOOM_STEP) }, "+"),
    h("button", { title: "Fit everything (0)", "aria-keyshortcuts": "0", onclick: fit }, "Fit"));
  return { element, draw, emphasise, find, fit, centre, onKey, zoomButtons, showAges, markStale, vertexOf, label: labelArrows };
}

// A hue for a namespace, always the same. Those of /robot1 and /robot2 differ by the golden angle.
const hueOf = (name) => Math.round([...name].reduce((sum, letter) => (sum * 31 + letter.charCodeAt(0)) % 9973, 7) * 137.508 % 360);

function bandElement(band) {
  const [left, top] = [band.x - band.w / 2, band.y - band.h / 2];
  return s("g", {},
    s("rect", { class: "band", x: left, y: top, width: band.w, height: band.h, rx: 8 }),
    s("text", { class: "name", x: left + 8, y: top + 14 }, band.name));
}

function linkElements(arrow) {
  const text = s("text", { class: "name", x: arrow.middle[0], y: arrow.middle[1], "text-anchor": "middle",
    "dominant-baseline": "central" }, arrow.text);
  const plate = s("rect", { class: "plate", rx: 3, height: PLATE, y: arrow.middle[1] - PLATE / 2 });
  const label = s("g", { class: arrow.wrong ? "link label wrong" : "link label" }, plate, text);
  setPlate(text, arrow.text);
  if (arrow.wrong) label.append(s("title", {}, arrow.wrong));
  const line = s("g", { class: arrow.wrong ? "link wrong" : "link" },
    s("path", { class: "arrow", d: arrow.path, "marker-end": arrow.wrong ? "url(#wrong-head)" : "url(#head)" }));
  return { arrow, text, parts: [line, label] };
}

// Lays the plate of a label over its arrow, as wide as the text.
function setPlate(text, shown) {
  const width = shown.length * LETTER;
  text.previousSibling.setAttribute("width", width);
  text.previousSibling.setAttribute("x", text.getAttribute("x") - width / 2);
}
