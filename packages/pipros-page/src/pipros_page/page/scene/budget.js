// The status line of the picture: pictures and data per second, the display that makes pictures slow, and the maximum number of
// points in this browser, which can be set here.

import { h, replace } from "../dom.js";

const INTERVAL_MS = 1000;
const CHOICES = [20000, 50000, 100000, 200000, 500000, 1000000, 2000000];

const thousands = (number) => number.toLocaleString("en-GB");

// Returns the element, which is updated until `signal` is aborted.
export function budgetLine(scene, signal) {
  const rates = h("span", {});
  const slow = h("span", { class: "scene-slow" });
  const points = h("span", {});
  const most = h("select", { "aria-label": "Points of all clouds", title: "Points that this browser receives, for all clouds together",
    onchange: () => {
    scene.mostPoints = Number(most.value);
    scene.hasNewClouds = true;
    scene.invalidate();
  } }, CHOICES.map((count) => h("option", { value: count, selected: count === scene.mostPoints }, `at most ${thousands(count)}`)));
  const share = h("span", { hidden: true }, points, " ", most);
  let last = { at: performance.now(), pictures: 0, bytes: 0 };

  function show() {
    const { pictures, bytes } = scene.figures;
    const now = performance.now();
    const elapsed = (now - last.at) / 1000;
    replace(rates, `${((pictures - last.pictures) / elapsed).toFixed(0)} pictures/s, ` +
      `${((bytes - last.bytes) / elapsed / 1e6).toFixed(1)} MB/s`);
    last = { at: now, pictures, bytes };
    replace(slow, scene.slow.text() ? `, ${scene.slow.text()}` : "");
    const clouds = scene.all().filter((display) => display.isOn && display.takeShare);
    const sum = (part) => clouds.reduce((total, display) => total + (display.points?.[part] ?? 0), 0);
    replace(points, `, ${thousands(sum("shown"))} of ${thousands(sum("total"))} points,`);
    share.hidden = !clouds.length;
    rates.hidden = share.hidden && slow.textContent === "";
  }

  const timer = setInterval(() => scene.isHidden || show(), INTERVAL_MS);
  signal.addEventListener("abort", () => clearInterval(timer));
  return h("div", { class: "scene-figures" }, rates, slow, share);
}
