// Names the display that takes more than half of the time of a slow picture.
//
// Pictures are slow if the browser asks for the next one late, several times in a row. Then two pictures are timed; before the second
// one, the scene is also drawn without the display that draws most. The page's thread does not wait for them.

const SLOW_MS = 100; // if the time from one picture to the next is longer, the picture is slow
const ROW = 4; // number of slow pictures in a row after which the display is searched for
const PAUSE_MS = 30000; // time until the next search
const POLL_MS = 4;
const HALF = 0.5;

export class SlowDisplay {
  constructor(scene) {
    this.scene = scene;
    this.found = null; // {display, share, ms}
    this.isLooking = false; // whether the search is running, during which no other pictures may be drawn
    this.slow = 0; // number of slow pictures in a row
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
    this.isLooking = true;
    this.look().then((found) => { this.found = found; }).finally(() => { this.isLooking = false; });
  }

  async look() {
    const shown = this.scene.all().filter((display) => display.isOn && !display.displays && display.root.visible);
    const weights = shown.map((display) => ({ display, weight: weightOf(display.root) }));
    const [heaviest] = weights.sort((one, other) => other.weight - one.weight);
    if (!heaviest?.weight) return null;
    const { display } = heaviest;
    const all = await this.timed(() => this.scene.draw());
    const both = await this.timed(() => {
      display.root.visible = false;
      this.scene.renderer.render(this.scene.world, this.scene.view.camera);
      display.root.visible = true;
      this.scene.draw();
    });
    const share = all > 0 ? 2 - both / all : 0;
    return share > HALF ? { display, share: Math.min(1, share), ms: all } : null;
  }

  // Returns a promise of the time (ms) until what is drawn is finished.
  async timed(draw) {
    await this.finished();
    const begin = performance.now();
    draw();
    await this.finished();
    return performance.now() - begin;
  }

  async finished() {
    const gl = this.scene.renderer.getContext();
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    while (fence && gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.UNSIGNALED) await new Promise((go) => setTimeout(go, POLL_MS));
    gl.deleteSync(fence);
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
