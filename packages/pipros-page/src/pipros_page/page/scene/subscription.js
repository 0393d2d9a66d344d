// The messages of a topic, which the server sends in batches.

import { messagesOf, unpacked } from "./batches.js";
import { decoderOf } from "./layout.js";

const LISTS = ["markers", "transforms"]; // fields whose elements have headers
const isLocal = ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);

export class Subscription {
  // `take(message, arrival, sender)` is called with each message, `onError(text)` with the reason if they cannot be decoded,
  // and `onLost(count)` with the number of messages dropped because this browser was too slow.
  constructor(scene, take, onError, onLost) {
    this.scene = scene;
    this.take = take;
    this.onError = onError;
    this.onLost = onLost;
    this.decode = null;
    this.senders = [];
    this.isOver = false;
  }

  // Subscribes to a topic. Returns a function that unsubscribes.
  begin(name, queue) {
    // Batches are processed in turn, because the next batch may arrive during decompression.
    let turn = Promise.resolve();
    const receive = (data) => {
      const { frames } = this.scene;
      const take = () => (data instanceof DataView ? this.addBatch(data, frames) : this.note(data));
      turn = turn.then(take).catch((error) => this.onError(error.message));
    };
    const stop = this.scene.context.watch("scene_messages", { name, queue, deflate: !isLocal }, receive,
      (text) => text && this.onError(text));
    return () => {
      this.isOver = true;
      stop();
    };
  }

  note({ senders, lost, layout }) {
    this.senders = senders ?? this.senders;
    if (lost) this.onLost(lost);
    if (layout?.error) this.onError(layout.error);
    if (layout?.types) this.decode = decoderOf(layout.types, layout.type);
  }

  async addBatch(data, frames) {
    this.scene.figures.bytes += data.byteLength;
    const batch = await unpacked(data);
    if (this.isOver || !this.decode || frames !== this.scene.frames) return; // messages of another source or moment
    for (const { body, arrival, sender } of messagesOf(batch, this.senders)) {
      try {
        this.add(this.decode(body), arrival, sender);
      } catch (error) {
        this.onError(error.message);
      }
    }
    this.scene.invalidate();
  }

  add(message, arrival, sender) {
    for (const key of LISTS) if (key in message) message[key] = message[key].filter((each) => !this.scene.isLate(each));
    if (!this.scene.isLate(message)) this.take(message, arrival, sender);
  }
}
