// The client side of the interactive markers' protocol: which markers each server has. Performs no I/O.
//
// A server publishes its whole state on `update_full` (latched), and each change on `update`, numbered
// consecutively. A client is ready as soon as it has a state and all changes since; after a gap, it waits for another state.

const MAX_QUEUED = 100;
const MAX_SERVERS = 100;
const SILENT_MS = 2000;
const KEEP_ALIVE = 0;
const RECEIVING = "Receiving updates.";

export class InteractiveClient {
  // `sink` has add(server, marker), move(server, pose), erase(server, name), clear(server), say(level, text, server)
  // and resubscribe().
  constructor(sink) {
    this.sink = sink;
    this.servers = new Map(); // id to {seq, isReady, queue, seenAt, isSilent}
  }

  server(id) {
    if (!this.servers.has(id)) {
      if (this.servers.size >= MAX_SERVERS) throw new Error(`More than ${MAX_SERVERS} servers on one topic`);
      this.servers.set(id, { seq: 0n, isReady: false, queue: [], seenAt: 0, isSilent: false });
    }
    return this.servers.get(id);
  }

  // Processes a whole state.
  initialize({ server_id: id, seq_num: number, markers }, nowMs) {
    const server = this.server(id);
    server.seenAt = nowMs;
    const seq = BigInt(number);
    if (server.isReady) return;
    const later = server.queue.filter((update) => BigInt(update.seq_num) > seq);
    if (later.length && BigInt(later[0].seq_num) !== seq + 1n) return; // an update in between is missing
    Object.assign(server, { seq, isReady: true, queue: [] });
    this.sink.clear(id);
    for (const marker of markers) this.sink.add(id, marker);
    this.sink.say("ok", RECEIVING, id);
    for (const update of later) this.update(update, nowMs);
  }

  // Processes a change or a keep-alive message.
  update(update, nowMs) {
    const { server_id: id } = update;
    const server = this.server(id);
    server.seenAt = nowMs;
    if (server.isSilent) this.sink.say("ok", RECEIVING, id);
    server.isSilent = false;
    const seq = BigInt(update.seq_num);
    const isAlive = update.type === KEEP_ALIVE;
    if (!server.isReady) {
      if (isAlive) return;
      server.queue.push(update);
      if (server.queue.length > MAX_QUEUED) server.queue.shift();
      return;
    }
    if (seq !== (isAlive ? server.seq : server.seq + 1n)) {
      this.restart(id, server);
      if (!isAlive) server.queue.push(update);
      return;
    }
    if (isAlive) return;
    server.seq = seq;
    for (const marker of update.markers) this.sink.add(id, marker);
    for (const pose of update.poses) this.sink.move(id, pose);
    for (const name of update.erases) this.sink.erase(id, name);
  }

  restart(id, server) {
    Object.assign(server, { isReady: false, queue: [] });
    this.sink.clear(id);
    this.sink.say("warning", "Updates were lost; waiting for the whole state.", id);
    this.sink.resubscribe();
  }

  // Reports servers that send no keep-alive messages.
  check(nowMs) {
    for (const [id, server] of this.servers) {
      const silence = nowMs - server.seenAt;
      if (!server.isReady || silence <= SILENT_MS) continue;
      server.isSilent = true;
      this.sink.say("warning", `No update received for ${Math.floor(silence / 1000)} seconds.`, id);
    }
  }
}
