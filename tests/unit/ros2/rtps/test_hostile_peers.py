"""Floods and false claims of peers: bounded, reported, and without effect on other peers."""

from __future__ import annotations

import tracemalloc

from pipros.basics.limits import Limits
from pipros.ros2.rtps.announcements import ParticipantData, write_participant
from pipros.ros2.rtps.encoding import acknack, data_frag_head, data_head, datagram_head, gap, heartbeat
from pipros.ros2.rtps.identity import PARTICIPANT_READER, PARTICIPANT_WRITER
from pipros.ros2.rtps.parameters import Address
from pipros.ros2.rtps.qos import Qos
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


def announcement(number: int) -> bytes:
    """A participant that does not exist."""
    prefix = b"liar" + number.to_bytes(8, "big")
    address = (Address("127.0.0.1", 9),)
    payload = write_participant(ParticipantData(prefix, discovery=address, lease_s=1e6))
    head = data_head(PARTICIPANT_READER, PARTICIPANT_WRITER, 1, len(payload))
    return datagram_head(prefix) + head + payload


def test_a_flood_of_participants_is_bounded() -> None:
    network = SimulatedNetwork()
    victim = network.host(Limits(ros2_discovery_bytes=100_000))
    for number in range(5000):
        victim.engine.receive(announcement(number), HOST, network.now)
        victim.engine.take_outgoing()

    assert 20 < len(victim.engine.peers) < 60
    sent = len(network.sent)
    network.run(310.0)  # even an endless lease ends
    assert len(victim.engine.peers) == 0
    assert len(network.sent) - sent < 30_000  # a hundred per second


def test_a_flood_of_fragments_stays_within_its_bytes() -> None:
    """Each fragment begins a sample of 100 MB, whose other fragments never arrive."""
    limits = Limits(ros2_incomplete_bytes=500_000)
    network, victim, _, peer, writer = connected(limits)
    reader_id = b"\0\0\0\0"
    piece = bytes(1000)
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    tracemalloc.start()
    try:
        for number in range(5000):
            start = data_frag_head(
                reader_id, writer, 2 + number // 40, number % 40 + 1, 1000, 100_000_000, 1000
            )
            victim.engine.receive(head + start + piece, HOST, network.now)
        used = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()

    assert used < 1_500_000


def test_others_receive_while_a_peer_floods() -> None:
    limits = Limits(ros2_incomplete_bytes=1_000_000)
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
    network, victim, reader, peer, writer = connected(Limits(ros2_sample_bytes=100_000))
    peer.engine.write(writer, bytes(200_000), network.now)
    peer.engine.write(writer, b"next", network.now)
    network.run_until(lambda: bool(victim.payloads(reader)))

    assert victim.payloads(reader) == [b"next"]
    assert victim.engine.reader(reader).lost == 1


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


def test_a_last_fragment_promises_no_memory() -> None:
    """Only the last fragments of samples of 128 MB arrive."""
    network, victim, _, peer, writer = connected(Limits(ros2_incomplete_bytes=2_000_000))
    head = datagram_head(peer.engine.prefix, victim.engine.prefix)
    tracemalloc.start()
    try:
        for number in range(200):
            start = data_frag_head(b"\0\0\0\0", writer, 2 + number, 128_000, 1000, 128_000_000, 1000)
            victim.engine.receive(head + start + bytes(1000), HOST, network.now)
        used = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()

    assert used < 3_000_000


def test_a_reader_that_never_answers_costs_no_more_than_the_history() -> None:
    limits = Limits(ros2_history_bytes=100_000)
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
