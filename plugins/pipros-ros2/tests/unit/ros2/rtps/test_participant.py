"""Participants of RTPS on real sockets, in one process and in two."""

import re
import signal
import sys
import threading
from collections.abc import Iterator
from queue import SimpleQueue

import pytest

from pipros.basics.errors import LimitExceeded, NotFound, PiprosError
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange
from pipros_ros2.rtps.events import Event, PeerChanged
from pipros_ros2.rtps.graph_info import (
    READER_QOS,
    TOPIC,
    TYPE_NAME,
    WRITER_QOS,
    GidBytes,
    Knowledge,
    NodeInfo,
    ParticipantInfo,
    write_info,
)
from pipros_ros2.rtps.identity import PARTICIPANT_ENTITY
from pipros_ros2.rtps.nodes import MAX_INFO_BYTES, Nodes
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.qos import DurabilityKind, Qos
from pipros_ros2.rtps.service_styles import PIPROS_MARK
from pipros_ros2.rtps.writer_proxy import RtpsSample
from tests.support import documents
from tests.support.constants import Constants
from tests.support.processes import Processes
from tests.support.ros2_domains import free_domain
from tests.support.waiting import wait_until

TYPE = "std_msgs::msg::dds_::String_"
MARKED = f"enclave=/;{PIPROS_MARK}=test;".encode()
QOS = Qos(depth=1000)
LIMIT_S = 60


@pytest.fixture
def discovery() -> Iterator[Discovery]:
    with free_domain() as domain:
        yield Discovery(domain)


@pytest.fixture
def pair(discovery: Discovery) -> Iterator[tuple[Participant, Participant]]:
    with Participant(discovery, MARKED) as one, Participant(discovery, MARKED) as other:
        yield one, other


def test_samples_arrive_in_order(pair: tuple[Participant, Participant]) -> None:
    received: list[bytes] = []
    reader = pair[1].add_reader("rt/a", TYPE, QOS, lambda sample: received.append(sample.payload))
    writer = pair[0].add_writer("rt/a", TYPE, QOS)
    assert writer.wait_for_readers(timeout_s=LIMIT_S)
    assert reader.wait_for_writers(timeout_s=LIMIT_S)
    sent = [b"\0\1\0\0" + number.to_bytes(4, "little") * (1 + number * 40) for number in range(500)]
    for payload in sent:
        writer.write(payload)
    assert writer.wait_for_acknowledgments(LIMIT_S)

    wait_until(lambda: len(received) == 500)
    assert received == sent
    assert (writer.readers(), reader.writers()) == ({reader.guid}, {writer.guid})


@pytest.mark.parametrize("is_direct", [False, True])
def test_a_callback_that_fails_stops_neither_the_others_nor_its_participant(
    pair: tuple[Participant, Participant], is_direct: bool
) -> None:
    received: list[bytes] = []

    def fail_once(sample: RtpsSample) -> None:
        received.append(sample.payload)
        if len(received) == 1:
            raise RuntimeError("can't start new thread")

    pair[1].add_reader("rt/a", TYPE, QOS, fail_once, is_direct=is_direct)
    writer = pair[0].add_writer("rt/a", TYPE, QOS)
    assert writer.wait_for_readers(timeout_s=LIMIT_S)
    writer.write(b"one.")
    wait_until(lambda: received)
    writer.write(b"two.")

    wait_until(lambda: received == [b"one.", b"two."])


def test_a_slow_callback_loses_the_oldest_samples(pair: tuple[Participant, Participant]) -> None:
    going_on: SimpleQueue[None] = SimpleQueue()
    received: list[bytes] = []

    def wait_first(sample: RtpsSample) -> None:
        received.append(sample.payload)
        if len(received) == 1:
            going_on.get(timeout=LIMIT_S)

    reader = pair[1].add_reader("rt/a", TYPE, Qos(depth=2), wait_first)
    writer = pair[0].add_writer("rt/a", TYPE, QOS)
    assert writer.wait_for_readers(timeout_s=LIMIT_S)
    writer.write(b"0...")
    wait_until(lambda: received)
    for number in range(1, 10):
        writer.write(b"%d..." % number)
    wait_until(lambda: reader.dropped == 7)
    going_on.put(None)

    wait_until(lambda: received == [b"0...", b"8...", b"9..."])


def test_the_end_of_a_participant_is_noticed_at_once(discovery: Discovery) -> None:
    events: list[Event] = []
    with Participant(discovery, on_event=events.append):
        other = Participant(discovery)
        wait_until(lambda: any(isinstance(each, PeerChanged) for each in events))
        other.close()
        other.close()

        wait_until(lambda: any(isinstance(each, PeerChanged) and not each.is_present for each in events))


def test_a_closed_participant_refuses_work(discovery: Discovery) -> None:
    participant = Participant(discovery)
    writer = participant.add_writer("rt/a", TYPE, QOS)
    participant.close()

    with pytest.raises(PiprosError, match="closed"):
        writer.write(b"late")
    writer.close()
    assert not writer.wait_for_readers(timeout_s=30)


def test_a_closed_writer_and_a_closed_reader_say_so(discovery: Discovery) -> None:
    with Participant(discovery) as participant:
        writer = participant.add_writer("rt/a", TYPE, QOS)
        reader = participant.add_reader("rt/a", TYPE, QOS, lambda _: None)
        for each in (writer, reader, writer, reader):
            each.close()

        with pytest.raises(NotFound, match="writer"):
            writer.write(b"late")
        with pytest.raises(NotFound, match="reader"):
            reader.writers()


def test_a_message_beyond_the_limit_is_refused(discovery: Discovery, constants: Constants) -> None:
    constants(ROS2_HISTORY_BYTES=1000)
    with Participant(discovery) as participant:
        writer = participant.add_writer("rt/a", TYPE, QOS)
        with pytest.raises(LimitExceeded, match="the limit is 1000 bytes"):
            writer.write(bytes(2000))


def test_a_writer_of_unlimited_depth_waits_for_its_readers(
    discovery: Discovery, constants: Constants
) -> None:
    """Its history has room for eight samples; no sample is displaced before all readers have it."""
    received: list[bytes] = []
    constants(ROS2_HISTORY_BYTES=10000)
    with Participant(discovery) as participant, Participant(discovery) as peer:
        peer.add_reader("rt/a", TYPE, Qos(depth=0), lambda sample: received.append(sample.payload))
        writer = participant.add_writer("rt/a", TYPE, Qos(depth=0))
        assert writer.wait_for_readers(timeout_s=LIMIT_S)
        sent = [b"\0\1\0\0" + bytes([number]) * 1000 for number in range(50)]
        for payload in sent:
            writer.write(payload, timeout_s=LIMIT_S)

        wait_until(lambda: received == sent)


def test_latched_samples_reach_late_readers(pair: tuple[Participant, Participant]) -> None:
    latched = Qos(durability=DurabilityKind.TRANSIENT_LOCAL, depth=1)
    writer = pair[0].add_writer("rt/map", TYPE, latched)
    writer.write(bytes(300_000))
    received: list[bytes] = []
    pair[1].add_reader("rt/map", TYPE, latched, lambda sample: received.append(sample.payload))

    wait_until(lambda: received == [bytes(300_000)])


def test_a_participant_of_range_off_finds_no_other(discovery: Discovery) -> None:
    with (
        Participant(Discovery(discovery.domain, DiscoveryRange.OFF)) as alone,
        Participant(Discovery(discovery.domain, DiscoveryRange.OFF)) as other,
    ):
        assert not alone.wait_for(lambda engine: len(engine.peers) > 0, 0.5)
        assert other.endpoints() == []


CTRL_C = """
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.qos import Qos
with Participant(Discovery(0)) as participant:
    writer = participant.add_writer("rt/a", "T", Qos())
    try:
        print("waiting", flush=True)
        writer.wait_for_readers(timeout_s=1000)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


def test_ctrl_c_ends_a_wait(processes: Processes) -> None:
    waiting = processes.start(sys.executable, "-c", CTRL_C)
    waiting.wait_for("waiting")
    waiting.send_signal(signal.SIGINT)

    assert (waiting.wait(), waiting.stdout) == (0, ["waiting", "interrupted"])


NODE = NodeInfo("/", "gateway")


def info_writers(participant: Participant) -> list[str]:
    """The topics of writers that a participant sees."""
    return [each.topic for each in participant.endpoints() if each.is_writer]


@pytest.mark.parametrize("size", GidBytes)
def test_nodes_are_announced_once_the_size_of_gids_is_learned(
    pair: tuple[Participant, Participant], size: GidBytes
) -> None:
    learning, witness = Nodes(pair[0]), Nodes(pair[1])
    learning.announce([NODE])
    assert witness.knowledge is Knowledge.UNKNOWN
    wait_until(lambda: any(each.topic == TOPIC for each in pair[1].endpoints()))
    assert info_writers(pair[1]) == []
    with Participant(pair[0].discovery) as third:
        Nodes(third, size).announce([NodeInfo("/", "talker")])
        wait_until(lambda: len(witness.others()) == 2)

        assert {node.name for each in witness.others() for node in each.nodes} == {"gateway", "talker"}
        assert learning.knowledge is witness.knowledge is Knowledge.KNOWN
        third_prefix = third.prefix
    learning.forget(third_prefix)
    assert learning.others() == []


def test_nothing_is_published_in_a_domain_with_both_sizes(pair: tuple[Participant, Participant]) -> None:
    careful = Nodes(pair[0], GidBytes.HUMBLE)
    careful.announce([NODE])
    wait_until(lambda: info_writers(pair[1]) == [TOPIC])
    other = pair[1].add_writer(TOPIC, TYPE_NAME, WRITER_QOS)
    info = ParticipantInfo(pair[1].prefix + PARTICIPANT_ENTITY, (NODE,))
    other.write(write_info(info, GidBytes.IRON_AND_LATER))

    wait_until(lambda: careful.knowledge is Knowledge.MIXED)
    wait_until(lambda: info_writers(pair[1]) == [])


def test_a_callback_that_meets_the_end_of_its_participant_is_not_reported(
    discovery: Discovery, caplog: pytest.LogCaptureFixture
) -> None:
    running, ended = threading.Event(), threading.Event()

    def use(_sample: RtpsSample) -> None:
        running.set()
        receiver.wait_for(lambda core: False, LIMIT_S)  # until the participant closes
        ended.set()
        receiver.add_writer("rt/late", TYPE, QOS)

    with Participant(discovery) as sender, Participant(discovery) as receiver:
        receiver.add_reader("rt/chatter", TYPE, QOS, use)
        writer = sender.add_writer("rt/chatter", TYPE, QOS)
        assert writer.wait_for_readers(1, timeout_s=LIMIT_S)
        writer.write(b"\0\1\0\0")
        assert running.wait(LIMIT_S)

    assert ended.is_set()
    assert "a callback for ROS 2 failed" not in caplog.text


def test_lists_of_nodes_beyond_the_limit_are_ignored(pair: tuple[Participant, Participant]) -> None:
    nodes = Nodes(pair[0], GidBytes.HUMBLE)
    received: list[int] = []
    pair[0].add_reader(TOPIC, TYPE_NAME, READER_QOS, lambda sample: received.append(len(sample.payload)))
    other = pair[1].add_writer(TOPIC, TYPE_NAME, WRITER_QOS)
    assert other.wait_for_readers(2, timeout_s=LIMIT_S)
    guid = pair[1].prefix + PARTICIPANT_ENTITY
    large = write_info(ParticipantInfo(guid, (NODE,) * 10_000), GidBytes.IRON_AND_LATER)
    assert len(large) > MAX_INFO_BYTES
    other.write(large)
    wait_until(lambda: received == [len(large)])
    assert other.wait_for_acknowledgments(LIMIT_S)

    other.write(write_info(ParticipantInfo(guid, (NODE,)), GidBytes.HUMBLE))
    wait_until(lambda: nodes.others() == [ParticipantInfo(guid, (NODE,))])
    assert nodes.knowledge is Knowledge.KNOWN


def test_the_example_in_the_documentation_runs(discovery: Discovery, processes: Processes) -> None:
    text = documents.text_of("internals/rtps.md")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    received: list[bytes] = []
    with Participant(discovery) as participant:
        participant.add_reader("rt/chatter", TYPE, QOS, lambda sample: received.append(sample.payload))
        script = code.replace("domain=0", f"domain={discovery.domain}")
        processes.start(sys.executable, "-c", script)

        wait_until(lambda: received == [b"\0\1\0\0\6\0\0\0hello\0\0\0"])  # padded to four bytes
