"""Floods and false claims of peers: bounded, reported, and without effect on other peers."""

import struct
import tracemalloc
from collections.abc import Callable, Iterable

import pytest

from pipros.basics.limits import Limits
from pipros_ros2.limits import Ros2Limits
from pipros_ros2.rtps.announcements import EndpointData, ParticipantData, write_endpoint, write_participant
from pipros_ros2.rtps.encoding import acknack, data_frag_head, data_head, datagram_head, gap, heartbeat
from pipros_ros2.rtps.events import Elsewhere, RtpsSettings
from pipros_ros2.rtps.identity import (
    PARTICIPANT_READER,
    PARTICIPANT_WRITER,
    PUBLICATIONS_WRITER,
    SUBSCRIPTIONS_READER,
    SUBSCRIPTIONS_WRITER,
)
from pipros_ros2.rtps.parameters import SENTINEL, Address
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.qos import Qos
from tests.support.constants import Constants
from tests.support.rtps_network import STRING, Host, SimulatedNetwork

HOST = "127.0.0.1"
DEEP = Qos(depth=1000)


def connected(limits: Limits) -> tuple[SimulatedNetwork, Host, bytes, Host, bytes]:
    """A victim with a reader, and a peer with a matched writer."""
    network = SimulatedNetwork()
    victim, peer = network.host(limits), network.host()
    reader = victim.engine.add_reader("rt/a", STRING, DEEP, network.now)
    writer = peer.engine.add_writer("rt/a", STRING, DEEP, network.now)
    network.run_until(lambda: bool(victim.matches() and peer.matches()))
    network.run(1.0)
    return network, victim, reader, peer, writer


def announcement(number: int, user_data: bytes = b"", host: str = HOST) -> bytes:
    """A participant that does not exist."""
    prefix = b"liar" + number.to_bytes(8, "big")
    address = (Address(host, 9),)
    data = ParticipantData(prefix, discovery=address, lease_s=1e6, user_data=user_data)
    payload = write_participant(data)
    head = data_head(PARTICIPANT_READER, PARTICIPANT_WRITER, 1, len(payload))
    return datagram_head(prefix) + head + payload


def test_a_flood_of_participants_is_bounded(constants: Constants) -> None:
    network = SimulatedNetwork()
    constants(ROS2_DISCOVERY_BYTES=100000)
    victim = network.host(Limits())
    for number in range(5000):
        victim.engine.receive(announcement(number), HOST, network.now)
        victim.engine.take_outgoing()

    assert 20 < len(victim.engine.peers) < 60
    sent = len(network.sent)
    network.run(310.0)  # even an endless lease ends
    assert len(victim.engine.peers) == 0
    assert len(network.sent) - sent < 30_000  # a hundred per second


def test_participants_that_never_answer_cause_little_work_and_displace_no_genuine_ones() -> None:
    network = SimulatedNetwork()
    victim, old, new = network.host(), network.host(lease_s=300.0), network.host()
    network.stop(new)
    network.run_until(lambda: bool(victim.peers() and old.peers()))
    network.run(1.0)
    for number in range(5000):
        victim.engine.receive(announcement(number), HOST, network.now)
        victim.engine.take_outgoing()
    network.hosts[new.address] = new
    network.run_until(lambda: victim.engine.peers.get(new.engine.prefix) is not None)
    sent = len(network.sent)
    network.run(100.0)

    assert len(network.sent) - sent < 40_000  # four in ten seconds to each of 500, not 5000
    assert victim.engine.peers.get(old.engine.prefix) is not None
    assert victim.engine.peers.get(new.engine.prefix) is not None


def memory_after(flood: Callable[[bytes], Iterable[bytes]]) -> int:
    """Return the bytes that a victim keeps of a flood of submessages, made for the entity id of a writer."""
    network, victim, _, peer, writer = connected(Limits())
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    tracemalloc.start()
    try:
        for submessage in flood(writer):
            victim.engine.receive(head + submessage, HOST, network.now)
        return tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()


EMPTY = b"".join(struct.pack("<HH", 0x100 + number, 0) for number in range(15_000)) + SENTINEL
FLOODS: dict[str, tuple[int, int, Callable[[bytes], Iterable[bytes]]]] = {
    "each fragment begins a sample of 100 MB": (500_000, 1_500_000, lambda writer: (
        data_frag_head(b"\0\0\0\0", writer, 2 + number // 40, number % 40 + 1, 1000, 100_000_000, 1000)
        + bytes(1000) for number in range(5000))),
    "the last fragments of samples of 128 MB": (2_000_000, 3_000_000, lambda writer: (
        data_frag_head(b"\0\0\0\0", writer, 2 + number, 128_000, 1000, 128_000_000, 1000) + bytes(1000)
        for number in range(200))),
    "early samples with 15,000 empty parameters": (200_000, 1_000_000, lambda writer: (
        data_head(b"\0\0\0\0", writer, 3 + number, 4, EMPTY) + bytes(4) for number in range(200))),
}  # fmt: skip


@pytest.mark.parametrize("name", FLOODS)
def test_what_remains_incomplete_or_unread_stays_within_its_bytes(constants: Constants, name: str) -> None:
    limit, most, flood = FLOODS[name]
    constants(ROS2_INCOMPLETE_BYTES=limit)
    assert memory_after(flood) < most


def test_others_receive_while_a_peer_floods(constants: Constants) -> None:
    constants(ROS2_INCOMPLETE_BYTES=1000000)
    limits = Limits()
    network, victim, reader, peer, writer = connected(limits)
    honest = network.host()
    other = honest.engine.add_writer("rt/a", STRING, DEEP, network.now)
    network.run_until(lambda: len(victim.matches()) == 2)
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    for number in range(3000):
        start = data_frag_head(b"\0\0\0\0", writer, 2 + number, 1, 1000, 90_000_000, 1000)
        victim.engine.receive(head + start + bytes(1000), HOST, network.now)
    honest.engine.write(other, bytes(500_000), network.now)
    network.run_until(lambda: bool(victim.payloads(reader)))

    assert victim.payloads(reader) == [bytes(500_000)]


def test_a_sample_beyond_the_limit_is_dropped_and_counted() -> None:
    network, victim, reader, peer, writer = connected(Limits(tables=(Ros2Limits(ros2_sample_bytes=100_000),)))
    peer.engine.write(writer, bytes(200_000), network.now)
    peer.engine.write(writer, b"next", network.now)
    network.run_until(lambda: bool(victim.payloads(reader)))

    assert (victim.payloads(reader), victim.engine.reader(reader).lost) == ([b"next"], 1)


def test_promises_of_endless_samples_cause_little_work() -> None:
    """A heartbeat announces 2**62 samples, GAPs leave holes everywhere, and no data follow."""
    network, victim, reader, peer, writer = connected(Limits())
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    for number in range(500):
        holes = gap(b"\0\0\0\0", writer, 10 + 1000 * number, 20 + 1000 * number, (30 + 1000 * number,))
        beat = heartbeat(b"\0\0\0\0", writer, 1, 1 << 62, 1000 + number)
        victim.engine.receive(head + holes + beat, HOST, network.now)
    sent = sum(len(part) for each in victim.engine.take_outgoing() for part in each.parts)

    assert sent < 1000
    assert victim.payloads(reader) == []


def test_requests_for_everything_do_not_multiply_what_is_sent() -> None:
    """The same 60 samples of 50 kB are requested 100 times in a row, and sent once."""
    network, victim, reader, peer, writer = connected(Limits())
    network.drops = lambda datagram: len(datagram) > 40_000
    for _ in range(60):
        peer.engine.write(writer, bytes(50_000), network.now)
    peer.engine.take_outgoing()
    head = datagram_head(victim.engine.prefix, peer.engine.prefix)
    everything = tuple(range(1, 61))
    for number in range(100):
        request = acknack(reader, writer, 1, everything, 5000 + number, is_final=True)
        peer.engine.receive(head + request, HOST, network.now)
    peer.engine.poll(network.now)
    sent = sum(len(part) for each in peer.engine.take_outgoing() for part in each.parts)

    assert sent < 200_000  # one burst; the rest waits for its turn


def test_announcements_for_another_participant_are_ignored() -> None:
    network = SimulatedNetwork()
    victim = network.host()
    forged = announcement(1).replace(b"liar" + bytes(7), b"fake" + bytes(7), 1)
    victim.engine.receive(forged, HOST, network.now)

    assert len(victim.engine.peers) == 0


def test_small_fragments_do_not_keep_their_large_datagrams() -> None:
    """Each datagram of 60 kB contains one fragment of 100 bytes; the rest is padding."""
    network, victim, _, peer, writer = connected(Limits())
    filling = data_head(b"\0\0\0\0", b"\0\0\x7f\3", 1, 60_000) + bytes(60_000)
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    tracemalloc.start()
    try:
        for number in range(500):
            start = data_frag_head(b"\0\0\0\0", writer, 1, number + 1, 100, 1_000_000, 100)
            victim.engine.receive(head + start + bytes(100) + filling, HOST, network.now)
        used = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()

    assert used < 500_000


def test_a_reader_that_never_answers_costs_no_more_than_the_history(constants: Constants) -> None:
    constants(ROS2_HISTORY_BYTES=100000)
    limits = Limits()
    network = SimulatedNetwork()
    victim, mute = network.host(limits), network.host()
    writer = victim.engine.add_writer("rt/a", STRING, DEEP, network.now)
    mute.engine.add_reader("rt/a", STRING, DEEP, network.now)
    network.run_until(lambda: bool(victim.matches()))
    network.drops = lambda _: True
    sent = len(network.sent)
    for _ in range(1000):
        victim.engine.write(writer, bytes(1000), network.now)
        network.flush()

    assert victim.engine.writer(writer).dropped > 800
    assert sum(len(datagram) for _, datagram in network.sent[sent:]) < 1_200_000


def test_announcements_that_grow_later_are_counted(constants: Constants) -> None:
    network = SimulatedNetwork()
    constants(ROS2_DISCOVERY_BYTES=1000000)
    victim = network.host(Limits())
    tracemalloc.start()
    try:
        for user_data in (b"", bytes(50_000)):
            for number in range(300):
                victim.engine.receive(announcement(number, user_data), HOST, network.now)
                victim.engine.take_outgoing()
                victim.engine.take_events()
        used = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()

    held = sum(len(peer.data.user_data) + 2_000 for peer in victim.engine.peers)
    assert held <= 1_000_000
    assert used < 3_000_000


def test_each_writer_is_answered_once_per_datagram() -> None:
    network, victim, _, peer, writer = connected(Limits())
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    victim.engine.take_outgoing()
    beats = [heartbeat(b"\0\0\0\0", writer, 2 + n, 2 + n, 100 + n, is_final=False) for n in range(1_700)]
    victim.engine.receive(head + b"".join(beats), HOST, network.now)
    answers = victim.engine.take_outgoing()

    assert len(answers) == 1
    assert sum(len(part) for part in answers[0].parts) < 100


def test_the_work_of_a_step_is_bounded_whatever_a_datagram_contains() -> None:
    """A datagram of 57 kB with ACKNACKs of 900 readers, which request all announcements."""
    network, victim, _, peer, _ = connected(Limits())
    for number in range(300):
        victim.engine.add_writer(f"rt/{number}", STRING, DEEP, network.now)
    victim.engine.take_outgoing()
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    everything = tuple(range(1, 257))
    requests = [
        acknack(struct.pack(">I", n), PUBLICATIONS_WRITER, 1, everything, 1, is_final=True)
        for n in range(900)
    ]
    steps = list(victim.engine.handle(head + b"".join(requests), HOST, network.now))

    assert len(steps) > 500
    assert max(steps) < 300
    sent = sum(len(part) for each in victim.engine.take_outgoing() for part in each.parts)
    assert sent < 1_000


@pytest.mark.parametrize("number", [(1 << 63) - 1, (1 << 62) + 1])
def test_sequence_numbers_that_no_writer_reaches_are_malformed(number: int) -> None:
    network, victim, reader, peer, writer = connected(Limits())
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    for text in (
        heartbeat(b"\0\0\0\0", writer, number, number, 100),
        heartbeat(b"\0\0\0\0", writer, 1, number, 101),
        data_head(b"\0\0\0\0", writer, number, 4) + bytes(4),
        gap(b"\0\0\0\0", writer, number, number),
    ):
        victim.engine.receive(head + text, HOST, network.now)
        victim.engine.poll(network.now)
    assert victim.engine.malformed == 4

    peer.engine.write(writer, b"next", network.now)
    network.run_until(lambda: bool(victim.payloads(reader)))


@pytest.mark.parametrize(("host", "source", "is_known"), [
    ("198.51.100.7", "198.51.100.7", True), ("198.51.100.8", "198.51.100.7", True),
    ("203.0.113.9", "198.51.100.7", False), ("203.0.113.9", "127.0.0.1", False),
    ("192.0.2.1", "198.51.100.7", True),  # a static peer
])  # fmt: skip
def test_data_is_sent_only_to_the_network_of_the_sender(host: str, source: str, is_known: bool) -> None:
    me = ParticipantData(b"the victim..", discovery=(Address(HOST, 7410),), data=(Address(HOST, 7411),))
    static = frozenset({"192.0.2.1"})
    engine = ParticipantCore(RtpsSettings(me, (), frozenset(), static_hosts=static), Limits(), 100.0)
    engine.receive(announcement(1, host=host), source, 100.0)
    recipients = {each.address.host for each in engine.take_outgoing()}

    assert (len(engine.peers) == 1) is is_known
    assert recipients == ({host} if is_known else set())
    refused = [each for each in engine.take_events() if isinstance(each, Elsewhere)]
    assert refused == ([] if is_known else [Elsewhere(b"liar" + bytes(7) + b"\1", source)])


def test_a_reader_elsewhere_gets_no_samples() -> None:
    """The participant has an address of its own, but its reader names another machine."""
    network, victim, _, peer, _ = connected(Limits())
    writer = victim.engine.add_writer("rt/b", STRING, Qos(), network.now)
    there = (Address("203.0.113.9", 9),)
    reader = EndpointData(peer.engine.prefix + b"\0\0\x7f\4", "rt/b", STRING, Qos(), addresses=there)
    payload = write_endpoint(reader)
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    start = data_head(SUBSCRIPTIONS_READER, SUBSCRIPTIONS_WRITER, 2, len(payload))
    victim.engine.receive(head + start + payload, HOST, network.now)
    beat = heartbeat(SUBSCRIPTIONS_READER, SUBSCRIPTIONS_WRITER, 2, 2, 900)
    victim.engine.receive(head + beat, HOST, network.now)
    victim.engine.write(writer, bytes(1000), network.now)

    assert victim.engine.endpoint(reader.guid) is not None
    assert reader.guid not in victim.engine.writer(writer).readers
