// Batches of serialized messages, as the view `scene_messages` sends them.

const HEAD_BYTES = 14; // before each message: its arrival (f64), its size (u32), the number of its sender (u16)

// Returns a promise of the messages of a batch, which may be compressed.
export async function unpacked(data) {
  const bytes = new Uint8Array(data.buffer, data.byteOffset + 1, data.byteLength - 1);
  if (!data.getUint8(0)) return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new DataView(await new Response(stream).arrayBuffer());
}

// Yields the messages of an unpacked batch: {body, arrival (s), sender}.
export function* messagesOf(batch, senders) {
  for (let at = 0; at + HEAD_BYTES <= batch.byteLength;) {
    const size = batch.getUint32(at + 8, true);
    yield {
      body: new DataView(batch.buffer, batch.byteOffset + at + HEAD_BYTES, size),
      arrival: batch.getFloat64(at, true),
      sender: senders[batch.getUint16(at + 12, true) - 1] ?? "",
    };
    at += HEAD_BYTES + size;
  }
}
