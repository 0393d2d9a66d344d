// Messages that tools publish.

const SENT_MS = 3000; // how long a topic stays advertised, for subscribers that connect later

// Returns a header with the current time and the fixed frame.
export function headerOf(scene) {
  const now = scene.now();
  return { seq: 0, stamp: { secs: Number(now / 1000000000n), nsecs: Number(now % 1000000000n) }, frame_id: scene.fixedFrame };
}

// Publishes a message on a topic {name, type}. Calls `report(problem)`, with an empty text when the message is published.
export function publishOnce(context, { name, type }, message, report) {
  const request = { name, type, message: JSON.stringify(message), rate: 0 };
  const stop = context.watch("publishing", request, () => report(""), (text) => text && report(text));
  setTimeout(stop, SENT_MS);
}
