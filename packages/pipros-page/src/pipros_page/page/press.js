// Holds updates back while a mouse button or a finger is pressed, so that the pressed element is still in its place at
// the release, and the browser reports a click. A drag does not hold them back.

const DRAG_PX = 5;
const CLICK_MS = 50; // maximum time from the release to the click
const LONGEST_MS = 30000;

let start = null; // {x, y} of the press; null while nothing is pressed
let timer = 0;
let held = []; // the calls that are held back, in order of arrival

function release() {
  clearTimeout(timer);
  start = null;
  const calls = held;
  held = [];
  for (const call of calls) queueMicrotask(call); // an error in one does not affect the others
}

function releaseAfter(milliseconds) {
  clearTimeout(timer);
  timer = setTimeout(release, milliseconds);
}

addEventListener("pointerdown", ({ button, clientX, clientY, target }) => {
  if (button !== 0 || (target instanceof Element && target.closest(".stick"))) return; // a person who steers a robot needs all values
  start = { x: clientX, y: clientY };
  releaseAfter(LONGEST_MS);
}, { capture: true });
addEventListener("pointermove", ({ clientX, clientY }) => {
  if (start && Math.hypot(clientX - start.x, clientY - start.y) > DRAG_PX) release();
}, { capture: true });
for (const end of ["pointerup", "pointercancel"]) {
  addEventListener(end, () => { if (start) releaseAfter(CLICK_MS); }, { capture: true });
}
addEventListener("blur", () => { if (start) releaseAfter(CLICK_MS); }); // when the window loses the focus

// Calls a function, now or after the press.
export function afterPress(call) {
  if (start) held.push(call);
  else call();
}
