"""Whatever a client of rosbridge or Foxglove sends, what its session keeps is counted, limited and returned.

An input is frames, separated by NUL bytes. Its first byte chooses the client: `r` a rosbridge client that may
only read, `c` one with control, `s` a stream, and anything else a Foxglove client. Each input is also sent a
hundred times with changing numbers, because a single message rarely exceeds a limit.

python -m tests.fuzz.bridge_sessions --seconds 60
"""

import asyncio
import sys
import tracemalloc
from typing import Any

from pipros.basics.limits import Limits
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.rosbridge.effects import Disconnect
from pipros_bridges.rosbridge.protocol import ClientProtocol
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.shares import ServerShares
from tests.fuzz import mutation
from tests.support.constants import changed
from tests.unit.bridges.foxglove.test_session import Conversation

LIMITS = Limits(tables=(BridgeLimits(bridge_message_bytes=20_000, bridge_queue_bytes=100_000),))
CONSTANTS = {
    "BRIDGE_READER_BYTES": 5_000, "BRIDGE_PARSED_BYTES": 200_000, "BRIDGE_KEPT_BYTES": 50_000,
    "BRIDGE_CLIENT_BYTES": 400_000, "BRIDGE_TOTAL_BYTES": 1_000_000,
}  # fmt: skip
REPETITIONS = 100
SLACK_BYTES = 300_000
"""Memory of a session that is not counted: empty containers, caches and the last messages."""
EFFECTS_PER_BYTE = 1
WORDS = [
    *(b'r{"op":"subscribe","topic":"/a#"}', b'c{"op":"publish","topic":"/a#","msg":{"data":[[],[],[]]}}'),
    *(b'c{"op":"advertise","topic":"/#","type":"std_msgs/String","id":"#"}', b's{"op":"', b's{"a":{"b":"'),
    *(b'r{"op":"fragment","id":#,"num":0,"total":2,"data":"{"}', b'r{"op":"unsubscribe","topic":"/a#"}'),
    *(b'c{"op":"advertise_service","service":"/#","type":"std_srvs/Empty"}', b'"id":[{"x":#}]', b"[[],[]]"),
    *(
        b'f{"op":"subscribe","subscriptions":[{"id":#,"channelId":1}]}',
        b'f{"op":"unsubscribe","subscriptionIds":[#]}',
    ),
    *(
        b'f{"op":"subscribeParameterUpdates","parameterNames":["/p#"]}',
        b'f{"op":"getParameters","parameterNames":["/"]}',
    ),
    *(
        b'f{"op":"advertise","channels":[{"id":#,"topic":"/c#","encoding":"json","schemaName":"std_msgs/String"}]}',
    ),
    *(b"\0", b"{", b"}", b'"', b"\\", b"#", b"x" * 500),
]


@changed(**CONSTANTS)
def target(data: bytes) -> None:
    kind, rest = data[:1], data[1:]
    frames = [frame for frame in rest.split(b"\0") if frame]
    repeated = (frame.replace(b"#", b"%d" % number) for number in range(REPETITIONS) for frame in frames)
    if kind in (b"r", b"c", b"s"):
        _rosbridge(repeated, is_reader=kind == b"r", is_stream=kind == b"s")
    else:
        asyncio.run(_foxglove(repeated))


def _rosbridge(frames: Any, *, is_reader: bool, is_stream: bool) -> None:
    server = ServerShares(LIMITS)
    shares = server.client(is_reader=is_reader)
    protocol = ClientProtocol(
        RosbridgeSettings(has_control=not is_reader), _resolve, LIMITS, lambda: 0.0, shares
    )
    tracemalloc.start()
    try:
        for frame in frames:
            text = frame.decode(errors="replace")
            if len(text) > shares.message_bytes:
                continue  # the connection is ended before the session sees such a message
            effects = list(protocol.receive_stream(text) if is_stream else protocol.receive(text))
            assert len(effects) <= EFFECTS_PER_BYTE * len(text) + 1, "too much work for the message"
            is_ended = any(isinstance(effect, Disconnect) for effect in effects)
            del effects
            if is_ended:
                break
        protocol.end_message()
        kept, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert kept <= shares.memory.used + SLACK_BYTES, f"{kept} bytes are kept, {shares.memory.used} counted"
    assert shares.kept.peak <= CONSTANTS["BRIDGE_KEPT_BYTES"]
    assert shares.memory.peak <= server.client_bytes
    shares.close()
    assert server.memory.used == 0


async def _foxglove(frames: Any) -> None:
    talk = Conversation(limits=LIMITS, has_control=True)
    shares = talk.client.shares
    for frame in frames:
        await talk.session.receive(frame.decode(errors="replace"))
        talk.client.outbox.pop()
        if talk.client.ended:
            break
    assert shares.kept.peak <= CONSTANTS["BRIDGE_KEPT_BYTES"]
    assert len(talk.session.takes()) + len(talk.session.sends()) <= CONSTANTS["BRIDGE_KEPT_BYTES"] / 1_000
    talk.session.close()
    shares.close()
    assert shares.memory.used == 0


def _resolve(name: str) -> str:
    return name if name.startswith("/") else f"/{name}"


if __name__ == "__main__":
    sys.exit(mutation.main(target, "bridge_sessions", WORDS))
