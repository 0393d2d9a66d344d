// Names the display that takes more than half of a slow picture.
//
// Pictures are slow if the browser asks for the next one late, several times in a row. Then the scene is drawn twice more, once
// without the display that draws most, and the difference is its time.

const SLOW_MS = 100; // from one picture to the next
const ROW = 4; // slow pictures, after which the display is looked for
const PAUSE_MS = 10000; // until it is looked for again
const HALF = 0.5;

export class SlowDisplay {
  constructor(scene) {
    this.scene = scene;
    this.found = null; // {display, share, ms}
    this.slow = 0; // pictures in a row
    this.lookedAt = -Infinity;
    this.last = { time: 0, isDrawn: false };
  }

  // Called with the time of each animation frame, and whether the scene is drawn in it.
  note(time, isDrawn) {
    const { last } = this;
    this.last = { time, isDrawn };
    if (!last.isDrawn) return;
    this.slow = time - last.time > SLOW_MS ? this.slow + 1 : 0;
    if (time - this.lookedAt < PAUSE_MS) return;
    if (this.found && !this.slow) this.found = null;
    if (this.slow < ROW) return;
    this.lookedAt = time;
    this.found = this.look();
  }

  look() {
    const shown = this.scene.all().filter((display) => display.isOn && !display.displays && display.root.visible);
    const weights = shown.map((display) => ({ display, weight: weightOf(display.root) }));
    const [heaviest] = weights.sort((one, other) => other.weight - one.weight);
    if (!heaviest?.weight) return null;
    const { display } = heaviest;
    const all = this.timed();
    display.root.visible = false;
    const others = this.timed();
    display.root.visible = true;
    const share = all > 0 ? (all - others) / all : 0;
    return share > HALF ? { display, share, ms: all } : null;
  }

  // Returns how long drawing takes, until the picture is finished.
  timed() {
    const { renderer, world, view } = this.scene;
    const gl = renderer.getContext();
    const begin = performance.now();
    renderer.render(world, view.camera);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return performance.now() - begin;
  }

  // One line about the display; empty if there is none.
  text() {
    if (!this.found) return "";
    const { display, share, ms } = this.found;
    const load = display.load();
    return `slow: ${display.name}${load ? ` (${load})` : ""} takes ${Math.round(share * 100)} % of ${Math.round(ms)} ms`;
  }
}

// Returns the number of vertices that an object draws.
function weightOf(root) {
  let sum = 0;
  root.traverseVisible(({ geometry, material }) => {
    if (!geometry || !material) return;
    const { count } = geometry.drawRange;
    sum += Number.isFinite(count) ? count : geometry.getIndex()?.count ?? geometry.getAttribute("position")?.count ?? 0;
  });
  return sum;
}
