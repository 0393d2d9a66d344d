"""Any datagrams leave the decoder and a participant of RTPS without an exception and within its limits.

An input is a list of datagrams, each after its length in two bytes. They are passed to an engine that has a
writer, a reader and a known peer. Time passes between the datagrams.

python -m tests.fuzz.rtps --seconds 60
"""

import sys
import tracemalloc
import zlib

from pipros.basics.limits import Limits
from pipros_ros2.limits import Ros2Limits
from pipros_ros2.rtps.announcements import (
    EndpointData,
    ParticipantData,
    read_endpoint,
    read_participant,
    write_endpoint,
    write_participant,
)
from pipros_ros2.rtps.decoding import read_datagram
from pipros_ros2.rtps.encoding import (
    acknack,
    data_frag_head,
    data_head,
    datagram_head,
    gap,
    heartbeat,
    nack_frag,
)
from pipros_ros2.rtps.events import RtpsSettings
from pipros_ros2.rtps.graph_info import GidBytes, read_info
from pipros_ros2.rtps.identity import (
    PARTICIPANT_READER,
    PARTICIPANT_WRITER,
    PUBLICATIONS_READER,
    PUBLICATIONS_WRITER,
    SUBSCRIPTIONS_READER,
    SUBSCRIPTIONS_WRITER,
)
from pipros_ros2.rtps.parameters import Address, SampleIdentity, related_sample
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.qos import DurabilityKind, Qos
from pipros_ros2.rtps.service_styles import Style, read_request
from pipros_ros2.rtps.writer_proxy import RtpsSample
from tests.fuzz import mutation
from tests.support.constants import changed

TOPIC, TYPE = "rt/a", "T"
LATCHED = Qos(durability=DurabilityKind.TRANSIENT_LOCAL, depth=5)
LIMITS = Limits(tables=(Ros2Limits(ros2_sample_bytes=500_000),))
MEMORY_BYTES = 8_000_000
RUN_ONCE_IN = 20
"""All inputs are decoded; running an engine takes 50 times as long."""
MEASURED_ONCE_IN = 200
"""Measuring the memory takes four times as long again."""
US, PEER = b"\0\0the engine", b"\1\x0fsome peer."
WRITER, READER = b"\0\0\1\3", b"\0\0\2\4"
"""The ids of the first writer and reader, in the engine; the peer's are the same."""


def write_input(*datagrams: bytes) -> bytes:
    return b"".join(len(each).to_bytes(2, "little") + each for each in datagrams)


def read_input(data: bytes) -> list[bytes]:
    datagrams = []
    while len(data) >= 2:
        end = 2 + int.from_bytes(data[:2], "little")
        datagrams.append(data[2:end])
        data = data[end:]
    return datagrams


def _sample(writer: bytes, reader: bytes, number: int, payload: bytes, inline: bytes = b"") -> bytes:
    payload += bytes(-len(payload) % 4)
    return data_head(reader, writer, number, len(payload), inline) + payload


def introduction() -> list[bytes]:
    """Datagrams with which a peer announces itself, a writer and a reader."""
    address = (Address("127.0.0.1", 7412),)
    head = datagram_head(PEER)
    me = write_participant(ParticipantData(PEER, discovery=address, data=address))
    endpoints = [write_endpoint(EndpointData(PEER + each, TOPIC, TYPE, LATCHED)) for each in (WRITER, READER)]
    return [
        head + _sample(PARTICIPANT_WRITER, PARTICIPANT_READER, 1, me),
        head + _sample(PUBLICATIONS_WRITER, PUBLICATIONS_READER, 1, endpoints[0]),
        head + _sample(SUBSCRIPTIONS_WRITER, SUBSCRIPTIONS_READER, 1, endpoints[1]),
    ]


def samples() -> list[bytes]:
    """Datagrams of a peer that has introduced itself."""
    head = datagram_head(PEER)
    identity = SampleIdentity(PEER + READER, 3)
    return [
        head + _sample(WRITER, READER, 1, b"\0\1\0\0text") + heartbeat(READER, WRITER, 1, 1, 1),
        head + _sample(WRITER, READER, 3, b"\0\1\0\0text", related_sample(identity)),
        head + data_frag_head(READER, WRITER, 2, 1, 100, 250, 100) + bytes(100),
        head + heartbeat(READER, WRITER, 1, 5, 2),
        head + data_frag_head(READER, WRITER, 2, 3, 100, 250, 52) + bytes(52),
        head + gap(READER, WRITER, 4, 5, (7, 9)),
        head + acknack(READER, WRITER, 1, (1, 3), 1, is_final=False),
        head + nack_frag(READER, WRITER, 2, (1, 2), 1),
        head + heartbeat(PUBLICATIONS_READER, PUBLICATIONS_WRITER, 1, 9, 1),
    ]


INTRODUCTION = introduction()
LARGE = bytes(70_000)
KNOWN = frozenset(mutation.corpus("rtps"))
WORDS = [
    *(each[20:] for each in (*INTRODUCTION, *samples())), b"\x07\x01\x1c\x00", b"\x15\x05", b"\x16\x01",
    b"\x08\x01", b"\x5a\x00\x10\x00", PEER, US, WRITER, READER,
]  # fmt: skip


@changed(
    ROS2_DISCOVERY_BYTES=200_000, ROS2_PEER_BYTES=100_000, ROS2_INCOMPLETE_BYTES=500_000,
    ROS2_INCOMPLETE_TOTAL_BYTES=1_000_000,
)  # fmt: skip
def target(data: bytes) -> None:
    datagrams = read_input(data)
    for datagram in datagrams:
        read_datagram(datagram, US)
    for read in (read_participant, read_endpoint):
        read(data)
    number = zlib.crc32(data)
    if number % RUN_ONCE_IN and data not in KNOWN:
        return
    if number % MEASURED_ONCE_IN:
        run(data)
        return
    tracemalloc.start()
    try:
        run(data)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < MEMORY_BYTES + 10 * len(data), f"{peak} bytes for {len(data)}"


def run(data: bytes) -> None:
    """Pass the datagrams of an input to an engine."""
    address = (Address("127.0.0.1", 7410),)
    me = ParticipantData(US, discovery=address, data=address)
    now = 1000.0
    engine = ParticipantCore(RtpsSettings(me, (), frozenset()), LIMITS, now)
    writer = engine.add_writer(TOPIC, TYPE, LATCHED, now)
    engine.add_reader(TOPIC, TYPE, LATCHED, now)
    engine.write(writer, LARGE, now)
    for datagram in (*INTRODUCTION, *read_input(data)):
        engine.receive(datagram, "127.0.0.1", now)
        now += 0.03
        engine.poll(now)
        for event in engine.take_events():
            _use(event)
        engine.take_outgoing()


def _use(event: object) -> None:
    """Read a sample as a request and as information on nodes."""
    sample = getattr(event, "sample", None)
    if isinstance(sample, RtpsSample):
        for style in Style:
            read_request(sample, style)
        for size in GidBytes:
            read_info(sample.payload, size)


if __name__ == "__main__":
    sys.exit(mutation.main(target, "rtps", WORDS))
