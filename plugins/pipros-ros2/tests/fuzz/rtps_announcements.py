"""Announcements of any number of participants stay within the bytes and the work of each of them.

An input is a list of announcements, each after its length in two bytes. The first byte of an announcement
selects the participant that sends it, the second the kind: of the participant itself, of a writer, or of a
reader. The rest replaces or extends the user data of an announcement, or is the announcement itself.

python -m tests.fuzz.rtps_announcements --seconds 60
"""

import sys

from pipros.basics.limits import process_limits
from pipros_ros2.rtps.announcements import EndpointData, ParticipantData, write_endpoint, write_participant
from pipros_ros2.rtps.encoding import data_head, datagram_head, heartbeat
from pipros_ros2.rtps.events import RtpsSettings
from pipros_ros2.rtps.identity import (
    PARTICIPANT_READER,
    PARTICIPANT_WRITER,
    PUBLICATIONS_READER,
    PUBLICATIONS_WRITER,
    SUBSCRIPTIONS_READER,
    SUBSCRIPTIONS_WRITER,
)
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.qos import Qos
from tests.fuzz import mutation
from tests.fuzz.rtps import read_input, write_input
from tests.support.constants import changed

DISCOVERY_BYTES = 60_000
PEER_BYTES = 20_000
ANSWER_BYTES = 400_000
MAX_WORK = 400
"""Of a single step; ACKNACKs with 256 numbers cost most."""
HOST = "127.0.0.1"
HERE = (Address(HOST, 7410),)
KINDS = (
    (PARTICIPANT_WRITER, PARTICIPANT_READER),
    (PUBLICATIONS_WRITER, PUBLICATIONS_READER),
    (SUBSCRIPTIONS_WRITER, SUBSCRIPTIONS_READER),
)
WORDS = [
    *(
        write_input(bytes([peer, kind, size]) + bytes(4 * size))
        for peer in (0, 9)
        for kind in range(6)
        for size in (0, 250)
    ),
    b"\x00\x03\x00\x00", b"\x01\x00\x00\x00", b"\x32\x00\x18\x00", b"\x31\x00\x18\x00", b"\x2c\x00\xff\xff",
]  # fmt: skip


def datagram(data: bytes, number: int) -> bytes:
    """Return the datagram for a part of the input; `number` is its sequence number."""
    peer, kind, rest = data[:1] or b"\0", data[1] if len(data) > 1 else 0, data[2:]
    prefix = b"\1\x0fpeer....." + peer
    writer, reader = KINDS[kind % 3]
    if kind % 6 >= 3:
        payload = rest
    elif kind % 3 == 0:
        payload = write_participant(ParticipantData(prefix, discovery=HERE, data=HERE, user_data=rest))
    else:
        entity = rest[:3].ljust(3, b"\0") + (b"\3" if kind % 3 == 1 else b"\4")
        payload = write_endpoint(EndpointData(prefix + entity, "rt/a", "T", Qos(), user_data=rest[3:]))
    payload += bytes(-len(payload) % 4)
    start = data_head(reader, writer, number, len(payload))
    beat = heartbeat(reader, writer, number, number, number) if kind % 3 else b""
    return datagram_head(prefix) + beat + start + payload


@changed(ROS2_DISCOVERY_BYTES=DISCOVERY_BYTES, ROS2_PEER_BYTES=PEER_BYTES)
def target(data: bytes) -> None:
    me = ParticipantData(b"\0\0the engine", discovery=HERE, data=HERE)
    now, sent, received = 1000.0, 0, 0
    engine = ParticipantCore(RtpsSettings(me, (), frozenset()), process_limits(), now)
    engine.add_writer("rt/a", "T", Qos(), now)
    engine.add_reader("rt/a", "T", Qos(), now)
    for number, part in enumerate(read_input(data), 1):
        arrived = datagram(part, number)
        steps = list(engine.handle(arrived, HOST, now))
        received += len(arrived)
        assert max(steps, default=0) <= MAX_WORK, steps
        now += 0.01
        engine.poll(now)
        engine.take_events()
        sent += sum(len(each) for outgoing in engine.take_outgoing() for each in outgoing.parts)
    held = 0
    for peer in engine.peers:
        kept = len(peer.data.user_data) + sum(len(each.user_data) for each in peer.endpoints.values())
        assert kept <= peer.kept.used <= PEER_BYTES, (kept, peer.kept.used)
        held += kept
    assert held <= DISCOVERY_BYTES, held
    assert sent <= ANSWER_BYTES + 40 * received, (sent, received)


if __name__ == "__main__":
    sys.exit(mutation.main(target, "rtps_announcements", WORDS))
