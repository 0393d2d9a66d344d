// A buffer of recent transforms: a port of pipros_libraries.transforms (buffer, tree, history), with the look-ups
// and error texts of tf2. Times are BigInt nanoseconds; 0n is the latest common time.

import { IDENTITY, composed, interpolated, inverted } from "./pose.js";

const LENGTH_NS = 10000000000n;
const MAX_DEPTH = 1000;
const MAX_FRAMES = 5000;
const MAX_POSES = 20000; // maximum number of poses of one frame
const TOLERANCE = 10e-3; // tolerance of a quaternion's squared norm

// Why a transform is not available. `kind` is the name of tf2's exception.
export class TransformError extends Error {
  constructor(kind, text) {
    super(text);
    this.kind = kind;
  }
}

class MovingFrame {
  constructor() {
    this.authority = "";
    this.stamps = [];
    this.parents = [];
    this.poses = [];
  }

  insert(stamp, parent, pose) {
    const { stamps } = this;
    const last = stamps.at(-1);
    if (last === undefined || stamp > last) this.put(stamps.length, stamp, parent, pose);
    else {
      if (last > stamp + LENGTH_NS) return false;
      const place = this.after(stamp);
      if (place && stamps[place - 1] === stamp) return false;
      this.put(place, stamp, parent, pose);
    }
    const bound = stamps.at(-1) - LENGTH_NS;
    let old = 0;
    while (stamps[old] < bound) old += 1;
    old = Math.max(old, stamps.length > MAX_POSES ? stamps.length >> 1 : 0);
    if (old) for (const list of [stamps, this.parents, this.poses]) list.splice(0, old);
    return true;
  }

  put(place, stamp, parent, pose) {
    this.stamps.splice(place, 0, stamp);
    this.parents.splice(place, 0, parent);
    this.poses.splice(place, 0, pose);
  }

  // Returns the number of stamps that are not after `time`.
  after(time) {
    let [low, high] = [0, this.stamps.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time < this.stamps[middle]) high = middle;
      else low = middle + 1;
    }
    return low;
  }

  locate(time) {
    const { stamps } = this;
    if (!stamps.length) return -1;
    if (time === 0n) return stamps.length - 1;
    return stamps[0] <= time && time <= stamps.at(-1) ? this.after(time) - 1 : -1;
  }

  pose(number, time) {
    const older = this.stamps[number];
    const next = number + 1;
    if (older === time || next === this.stamps.length || this.parents[number] !== this.parents[next]) return this.poses[number];
    const ratio = Number(time - older) / Number(this.stamps[next] - older);
    return interpolated(this.poses[number], this.poses[next], ratio);
  }

  whyNot(time) {
    if (!this.stamps.length) return "";
    const [oldest, newest] = [this.stamps[0], this.stamps.at(-1)];
    if (oldest === newest) return `Lookup would require extrapolation at time ${seconds(time)}, but only time ${seconds(newest)} is in ` +
      `the buffer`;
    const [where, word, known, gap] = time > newest ? ["future", "latest", newest, time - newest]
      : ["past", "earliest", oldest, oldest - time];
    return `Lookup would require extrapolation ${seconds(gap)}s into the ${where}.  Requested time ${seconds(time)} but the ` +
      `${word} data is at time ${seconds(known)}`;
  }

  latest() {
    return this.stamps.length ? [this.stamps.at(-1), this.parents.at(-1)] : [0n, null];
  }

  clear() {
    this.stamps.length = this.parents.length = this.poses.length = 0;
  }
}

class StaticFrame {
  constructor() {
    this.authority = "";
    this.parents = [];
    this.known = null;
  }

  insert(_stamp, parent, pose) {
    this.parents = [parent];
    this.known = pose;
    return true;
  }

  locate() {
    return this.parents.length ? 0 : -1;
  }

  pose() {
    return this.known;
  }

  whyNot() {
    return "";
  }

  latest() {
    return [0n, this.parents[0] ?? null];
  }

  clear() {}
}

export class Frames {
  constructor() {
    this.frames = new Map(); // name to history, or null for a root
    this.version = 0; // changes with each transform
  }

  // Adds the pose of `child` in `parent`. Returns whether it was accepted.
  insert(parent, child, stamp, pose, authority = "", isStatic = false) {
    parent = withoutSlash(parent);
    child = withoutSlash(child);
    if (this.problemOf(parent, child, stamp, pose)) return false;
    let frame = this.frames.get(child);
    if (!frame) {
      if (this.frames.size >= MAX_FRAMES) return false;
      frame = isStatic ? new StaticFrame() : new MovingFrame();
      this.frames.set(child, frame);
    }
    if (!this.frames.has(parent)) this.frames.set(parent, null);
    if (!frame.insert(stamp, parent, pose)) return false;
    [frame.authority, frame.heardMs] = [authority, performance.now()]; // when this browser got the newest transform
    this.version += 1;
    return true;
  }

  // Returns why a transform is not accepted, or an empty text.
  problemOf(parent, child, stamp, pose) {
    const norm = pose[3] ** 2 + pose[4] ** 2 + pose[5] ** 2 + pose[6] ** 2;
    if (!pose.every(Number.isFinite)) return "it contains invalid floating point values (nans or infs)";
    if (!(Math.abs(norm - 1) < TOLERANCE)) return "its quaternion does not have the length 1";
    if (!parent || !child) return "a frame has no name";
    if (parent === child) return "a frame cannot be its own parent";
    return stamp < 0n ? "its time is negative" : "";
  }

  // Removes all transforms except static ones.
  clear() {
    for (const frame of this.frames.values()) frame?.clear();
    this.version += 1;
  }

  has(name) {
    return this.frames.has(name);
  }

  names() {
    return [...this.frames.keys()];
  }

  // Returns the parent of a frame by its newest transform, or null.
  parent(name) {
    return this.frames.get(name)?.latest()[1] ?? null;
  }

  authority(name) {
    return this.frames.get(name)?.authority ?? "";
  }

  // Returns the stamp of a frame's newest transform; 0n if it is static or a root.
  newestStamp(name) {
    return this.frames.get(name)?.latest()[0] ?? 0n;
  }

  // Returns the pose of `source` in `target`. Throws a TransformError.
  lookup(target, source, time) {
    if (target === source) return IDENTITY;
    for (const [name, role] of [[target, "target"], [source, "source"]]) this.require(name, `lookupTransform argument ${role}_frame`);
    return this.path(target, source, time);
  }

  require(name, what) {
    if (this.frames.has(name)) return;
    if (!name) throw new TransformError("InvalidArgumentException", `Invalid argument passed to ${what} in tf2 frame_ids cannot be empty`);
    if (name[0] === "/") throw new TransformError("InvalidArgumentException",
      `Invalid argument "${name}" passed to ${what} in tf2 frame_ids cannot start with a '/' like: `);
    throw new TransformError("LookupException", `"${name}" passed to ${what} does not exist. `);
  }

  path(target, source, time) {
    if (time === 0n) time = this.latestCommonTime(target, source);
    const up = [];
    let interrupted = null;
    let name = source;
    for (;;) {
      const frame = this.frames.get(name);
      if (!frame) break;
      const number = frame.locate(time);
      if (number < 0) {
        interrupted = frame;
        break;
      }
      if (name === target) return poseOfPath(up, [], time);
      up.push([frame, number]);
      if (up.length > MAX_DEPTH) throw this.loop();
      name = frame.parents[number];
    }
    const top = name;
    const down = [];
    name = target;
    while (name !== top) {
      const frame = this.frames.get(name);
      if (!frame) break;
      const number = frame.locate(time);
      if (number < 0) throw new TransformError("ExtrapolationException", `${frame.whyNot(time)}${requested(source, target)}`);
      if (name === source) return poseOfPath([], down, time);
      down.push([frame, number]);
      if (down.length > MAX_DEPTH) throw this.loop();
      name = frame.parents[number];
    }
    if (name !== top) {
      if (interrupted) throw new TransformError("ExtrapolationException", `${interrupted.whyNot(time)}${requested(source, target)}`);
      throw notConnected(target, source);
    }
    return poseOfPath(up, down, time);
  }

  // Returns the latest time at which a transform between the frames is available; 0n if all are static.
  latestCommonTime(target, source) {
    if (source === target) return this.frames.get(source)?.latest()[0] ?? 0n;
    let common = null;
    const earliest = (stamp) => {
      if (stamp && (common === null || stamp < common)) common = stamp;
    };
    const seen = [];
    for (const [stamp, parent] of this.ancestors(source)) {
      earliest(stamp);
      seen.push([stamp, parent]);
      if (parent === target) return common ?? 0n;
    }
    const above = new Set(seen.map(([, parent]) => parent));
    common = null;
    let meeting = null;
    for (const [stamp, parent] of this.ancestors(target)) {
      earliest(stamp);
      if (above.has(parent)) {
        meeting = parent;
        break;
      }
      if (parent === source) return common ?? 0n;
    }
    if (meeting === null) throw notConnected(target, source);
    for (const [stamp, parent] of seen) {
      earliest(stamp);
      if (parent === meeting) break;
    }
    return common ?? 0n;
  }

  // Yields the stamp and the parent of the newest transform of a frame and of its ancestors.
  * ancestors(name) {
    for (let depth = 0; depth <= MAX_DEPTH; depth += 1) {
      const frame = this.frames.get(name);
      const [stamp, parent] = frame ? frame.latest() : [0n, null];
      if (parent === null) return;
      yield [stamp, parent];
      name = parent;
    }
    throw this.loop();
  }

  // Returns the newest links {child, parent, stamp} from a frame up to the root of its tree. Throws a TransformError.
  linksAbove(name) {
    const links = [];
    for (const [stamp, parent] of this.ancestors(name)) links.push({ child: links.at(-1)?.parent ?? name, parent, stamp });
    return links;
  }

  loop() {
    return new TransformError("LookupException", "The tf tree is invalid because it contains a loop.");
  }
}

function poseOfPath(up, down, time) {
  const joined = (steps) => steps.reduce((found, [frame, number]) => {
    const step = frame.pose(number, time);
    return found ? composed(step, found) : step;
  }, null);
  const found = joined(up);
  const target = joined(down);
  if (!target) return found ?? IDENTITY;
  const back = inverted(target);
  return found ? composed(back, found) : back;
}

const withoutSlash = (name) => (name.startsWith("/") ? name.slice(1) : name);
const requested = (source, target) => `, when looking up transform from frame [${source}] to frame [${target}]`;
const notConnected = (target, source) => new TransformError("ConnectivityException",
  `Could not find a connection between '${target}' and '${source}' because they are not part of the same tree.Tf has two or more ` +
    `unconnected trees.`);

// Formats nanoseconds as tf2 does: in seconds, with nine decimals.
export const seconds = (time) => `${time / 1000000000n}.${String(time % 1000000000n).padStart(9, "0")}`;
