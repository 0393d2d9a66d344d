// Zoom and pan of a picture, and the pixel under the cursor.

import { h } from "./dom.js";

const STEP = 1.25;
const MOST = 64; // times

// Makes a canvas and its siblings, which are drawn with `object-fit: contain`, zoom by wheel, + and -, and move by dragging and the
// arrow keys. `onPixel(at)` is called with {x, y} of the pixel under the cursor; with null if there is none. Returns {buttons, fit,
// follow(view), onView(view)}: `onView`, which can be replaced, is called with what the user chose, and `follow` shows it in another
// picture.
export function imageZoom(canvas, onPixel) {
  const area = canvas.parentElement;
  let view = { scale: 1, x: 0, y: 0 }; // the position of the canvas, in pixels of the screen
  let grabbed = null; // the last pointer event of a drag
  const own = { follow: (next) => place(next), onView: (_view) => {} };

  function show(next) {
    place(next);
    own.onView(view);
  }

  function place(next) {
    const { clientWidth: wide, clientHeight: high } = canvas;
    const scale = Math.min(MOST, Math.max(1, next.scale));
    const inside = (at, size) => Math.min(0, Math.max(size * (1 - scale), at));
    view = { scale, x: inside(next.x, wide), y: inside(next.y, high) };
    for (const each of area.children) each.style.transform = scale === 1 ? "" : `translate(${view.x}px, ${view.y}px) scale(${scale})`;
    canvas.style.cursor = scale === 1 ? "" : "grab";
  }

  // Zooms about a point of the canvas before the zoom; about its middle by default.
  function zoom(factor, at = { x: canvas.clientWidth / 2, y: canvas.clientHeight / 2 }) {
    const scale = Math.min(MOST, Math.max(1, view.scale * factor));
    show({ scale, x: at.x - ((at.x - view.x) * scale) / view.scale, y: at.y - ((at.y - view.y) * scale) / view.scale });
  }

  const fit = () => show({ scale: 1, x: 0, y: 0 });

  // Returns the pixel at a place on the screen, or null.
  function pixelAt({ clientX, clientY }) {
    const box = canvas.getBoundingClientRect();
    const scale = Math.min(box.width / canvas.width, box.height / canvas.height);
    const x = Math.floor((clientX - box.left - (box.width - canvas.width * scale) / 2) / scale);
    const y = Math.floor((clientY - box.top - (box.height - canvas.height * scale) / 2) / scale);
    return x >= 0 && y >= 0 && x < canvas.width && y < canvas.height ? { x, y } : null;
  }

  area.addEventListener("wheel", (event) => {
    event.preventDefault();
    const box = canvas.getBoundingClientRect();
    zoom(1.0015 ** -event.deltaY, { x: event.clientX - box.left + view.x, y: event.clientY - box.top + view.y });
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => {
    grabbed = event;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (grabbed) show({ ...view, x: view.x + event.clientX - grabbed.clientX, y: view.y + event.clientY - grabbed.clientY });
    if (grabbed) grabbed = event;
    onPixel(pixelAt(event));
  });
  canvas.addEventListener("pointerleave", () => onPixel(null));
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { grabbed = null; });
  canvas.addEventListener("dblclick", fit);
  area.tabIndex = 0;
  area.addEventListener("keydown", (event) => {
    const move = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] }[event.key];
    if (move) show({ ...view, x: view.x + move[0], y: view.y + move[1] });
    else if (event.key === "+" || event.key === "=") zoom(STEP);
    else if (event.key === "-") zoom(1 / STEP);
    else if (event.key === "0") fit();
    else return;
    event.preventDefault();
  });

  const buttons = h("span", { class: "buttons", role: "group", "aria-label": "Zoom" },
    h("button", { "aria-label": "Zoom out", title: "Zoom out (-)", onclick: () => zoom(1 / STEP) }, "−"),
    h("button", { "aria-label": "Zoom in", title: "Zoom in (+)", onclick: () => zoom(STEP) }, "+"),
    h("button", { title: "Fit the picture (0)", onclick: fit }, "Fit"));
  return Object.assign(own, { buttons, fit });
}
