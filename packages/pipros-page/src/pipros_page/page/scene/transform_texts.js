// Texts about missing transforms: rviz's own, the cause, and a remedy.

const LINK_AGE_S = 2;

// Returns a status text for a frame without a transform, as rviz writes it.
export function whyNot(frames, fixedFrame, frame, error) {
  if (!frames.has(frame)) return `For frame [${frame}]: Frame [${frame}] does not exist`;
  if (!frames.has(fixedFrame)) return `For frame [${frame}]: Fixed Frame [${fixedFrame}] does not exist`;
  return `For frame [${frame}]: No transform to fixed frame [${fixedFrame}].  TF error: [${error.message}]`;
}

// Returns the status of the fixed frame: [level, text]. `problem` says why a transform was refused.
export function fixedFrameStatus(frames, fixedFrame, problem) {
  if (frames.has(fixedFrame)) return problem ? ["warning", problem] : ["ok", "OK"];
  if (!frames.names().length) return ["warning", problem || "No TF data"];
  return ["error", `Unknown frame ${fixedFrame}`];
}

// Returns why a frame has no pose in the fixed frame: the frame is in another tree, or a link is old. Empty if
// nothing is known.
export function explanation(frames, fixedFrame, frame, now, clockMs = performance.now()) {
  if (!frames.has(frame)) return "";
  try {
    return explained(frames, fixedFrame, frame, now, clockMs);
  } catch (error) {
    return error.message; // a loop
  }
}

function explained(frames, fixedFrame, frame, now, clockMs) {
  const [links, others] = [frame, fixedFrame].map((name) => frames.linksAbove(name));
  const root = links.at(-1)?.parent ?? frame;
  if (root !== (others.at(-1)?.parent ?? fixedFrame))
    return `[${frame}] is in the tree of [${root}], but the fixed frame is not; with [${root}] as the fixed frame, it would be shown.`;
  const [oldest] = [...links, ...others].filter(({ stamp }) => stamp > 0n).sort((one, other) => (one.stamp < other.stamp ? -1 : 1));
  if (!oldest) return "";
  const age = Number(now - oldest.stamp) / 1e9;
  if (age <= LINK_AGE_S) return "";
  const sender = frames.authority(oldest.child);
  // While transforms arrive, the sender has not stopped, even if they are old on arrival.
  const isHeard = clockMs - frames.frames.get(oldest.child).heardMs <= LINK_AGE_S * 1000;
  return `The transform from [${oldest.child}] to [${oldest.parent}]${sender ? `, sent by [${sender}],` : ""} is ${age.toFixed(0)} s ` +
    `old; ${isHeard ? "newer ones still arrive: this browser is slow, or the sender's clock is behind." : "its sender may have stopped."}`;
}

function rootOf(frames, name) {
  try {
    return frames.linksAbove(name).at(-1)?.parent ?? name;
  } catch {
    return null; // a loop
  }
}

// Returns the roots of the trees without the fixed frame, the largest tree first: fixed frames that would show something.
export function otherRoots(frames, fixedFrame) {
  const sizes = new Map();
  for (const name of frames.names()) {
    const root = rootOf(frames, name);
    if (root === null) continue;
    sizes.set(root, (sizes.get(root) ?? 0) + 1);
    if (name === fixedFrame) sizes.set(root, -Infinity);
  }
  return [...sizes].filter(([, size]) => size > 1).sort((one, other) => other[1] - one[1]).map(([root]) => root);
}
