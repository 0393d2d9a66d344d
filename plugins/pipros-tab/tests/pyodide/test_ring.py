"""The rings of a tab: a full one refuses packets, and loses none."""

import json
import subprocess

from tests.support.environments import REPOSITORY

MODULE = REPOSITORY / "plugins/pipros-tab/src/pipros_tab/page/ring.mjs"
PROGRAM = f"""
import {{ eachPacket, Ring, RING_BYTES }} from "{MODULE}";
const ring = new Ring();
const buffer = new Uint8Array(RING_BYTES);
const content = new Uint8Array(50_000);
const received = [];
let sent = 0;
const written = [];
for (let round = 0; round < 3; round++) {{
  while (ring.write(8, sent, content.fill(sent))) sent++;
  written.push(sent);
  eachPacket(buffer, ring.read(buffer), (kind, end, found) => {{
    received.push(kind === 8 && found.length === 50_000 && found.every((byte) => byte === end) && end);
  }});
}}
console.log(JSON.stringify([written, received]));
"""


def test_packets_arrive_whole_and_in_order_after_a_full_ring() -> None:
    command = ["node", "--input-type=module", "--eval", PROGRAM]
    done = subprocess.run(command, capture_output=True, check=True, timeout=60)
    in_one_ring = 2**20 // (50_000 + 12)
    written, received = json.loads(done.stdout)
    assert written == [in_one_ring, 2 * in_one_ring, 3 * in_one_ring]
    assert received == list(range(3 * in_one_ring))
