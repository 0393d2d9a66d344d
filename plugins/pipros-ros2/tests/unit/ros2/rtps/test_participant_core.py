"""Participants that find each other and exchange samples, in simulated time."""

import pytest

from pipros.basics.errors import LimitExceeded, NotFound
from pipros.basics.limits import Limits
from pipros_ros2.rtps.decoding import read_datagram
from pipros_ros2.rtps.identity import CYCLONE_DDS, FAST_DDS, PARTICIPANT_WRITER
from pipros_ros2.rtps.qos import DurabilityKind, Qos, QosPolicy, ReliabilityKind
from pipros_ros2.rtps.submessages import AckNack, Submessage
from tests.support.constants import Constants
from tests.support.rtps_network import STRING, Host, SimulatedNetwork

LATCHED = Qos(durability=DurabilityKind.TRANSIENT_LOCAL, depth=1)
DEEP = Qos(depth=2000)


def pair(network: SimulatedNetwork, offered: Qos, requested: Qos) -> tuple[Host, bytes, Host, bytes]:
    """A writer and a reader of one topic that have matched."""
    talker, listener = network.host(), network.host()
    writer = talker.engine.add_writer("rt/chatter", STRING, offered, network.now)
    reader = listener.engine.add_reader("rt/chatter", STRING, requested, network.now)
    network.run_until(lambda: bool(talker.matches() and listener.matches()))
    return talker, writer, listener, reader


def test_samples_reach_a_matched_reader_in_order() -> None:
    network = SimulatedNetwork()
    talker, writer, listener, reader = pair(network, Qos(), Qos())
    sent = [b"\0\1\0\0" + bytes([number]) * number for number in range(50)]
    for payload in sent:
        talker.engine.write(writer, payload, network.now)
        network.flush()

    received = listener.payloads(reader)
    assert [payload[: len(each)] for payload, each in zip(received, sent, strict=True)] == sent


@pytest.mark.parametrize("loss", [0.05, 0.3])
@pytest.mark.parametrize("size", [8, 200_000])
def test_nothing_is_lost_on_a_lossy_network(loss: float, size: int) -> None:
    network = SimulatedNetwork(seed=7, loss=loss)
    talker, writer, listener, reader = pair(network, DEEP, DEEP)
    sent = [number.to_bytes(4, "big") * (size // 4) for number in range(1000 if size == 8 else 20)]
    for payload in sent:
        talker.engine.write(writer, payload, network.now)
        network.run(0.001)
    network.run_until(lambda: len(listener.payloads(reader)) >= len(sent))

    assert listener.payloads(reader) == sent
    network.run_until(lambda: talker.engine.writer(writer).is_acknowledged)


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_a_late_reader_gets_the_latched_sample(loss: float) -> None:
    network = SimulatedNetwork(seed=3, loss=loss)
    talker = network.host()
    writer = talker.engine.add_writer("rt/map", STRING, LATCHED, network.now)
    for payload in (b"old.", b"new."):
        talker.engine.write(writer, payload, network.now)
    network.run(5.0)
    listener = network.host()
    reader = listener.engine.add_reader("rt/map", STRING, LATCHED, network.now)
    network.run_until(lambda: bool(listener.payloads(reader)))

    assert listener.payloads(reader) == [b"new."]


def test_a_late_volatile_reader_gets_only_new_samples() -> None:
    network = SimulatedNetwork()
    talker = network.host()
    writer = talker.engine.add_writer("rt/map", STRING, LATCHED, network.now)
    talker.engine.write(writer, b"old.", network.now)
    listener = network.host()
    reader = listener.engine.add_reader("rt/map", STRING, Qos(), network.now)
    network.run_until(lambda: bool(talker.matches()))
    talker.engine.write(writer, b"new.", network.now)
    network.run(1.0)

    assert listener.payloads(reader) == [b"new."]


def test_best_effort_samples_are_not_repeated() -> None:
    network = SimulatedNetwork()
    best_effort = Qos(ReliabilityKind.BEST_EFFORT)
    talker, writer, listener, reader = pair(network, Qos(), best_effort)
    network.drops = lambda datagram: b"lost" in datagram
    for payload in (b"one.", b"lost", b"two."):
        talker.engine.write(writer, payload, network.now)
    network.run(2.0)

    assert listener.payloads(reader) == [b"one.", b"two."]


def test_a_sample_for_one_reader_is_skipped_by_the_others() -> None:
    network = SimulatedNetwork(seed=5, loss=0.2)
    talker, writer, one, first = pair(network, DEEP, DEEP)
    other = network.host()
    second = other.engine.add_reader("rt/chatter", STRING, DEEP, network.now)
    network.run_until(lambda: len(talker.matches()) == 2 and bool(other.matches()))
    only_first = frozenset([one.engine.prefix + first])
    for number in range(40):
        talker.engine.write(writer, b"a%3d" % number, network.now, recipients=only_first)
        talker.engine.write(writer, b"b%3d" % number, network.now)
    network.run_until(lambda: len(one.payloads(first)) == 80 and len(other.payloads(second)) == 40)

    assert other.payloads(second) == [b"b%3d" % number for number in range(40)]
    assert one.payloads(first)[:3] == [b"a  0", b"b  0", b"a  1"]


def test_a_sample_that_is_no_longer_kept_does_not_stop_the_others() -> None:
    network = SimulatedNetwork()
    talker, writer, listener, reader = pair(network, Qos(depth=2), Qos())
    network.drops = lambda datagram: b"lost" in datagram
    for payload in (b"lost", b"lost", b"one.", b"two."):
        talker.engine.write(writer, payload, network.now)
    network.run(2.0)

    assert (listener.payloads(reader), talker.engine.writer(writer).dropped) == ([b"one.", b"two."], 2)


def test_endpoints_without_a_match_are_listed_until_they_end() -> None:
    network = SimulatedNetwork()
    talker, listener = network.host(), network.host()
    talker.engine.add_writer("rt/a", STRING, Qos(), network.now)
    for qos in (Qos(), LATCHED):
        reader = listener.engine.add_reader("rt/a", STRING, qos, network.now)
    listener.engine.add_reader("rt/b", STRING, LATCHED, network.now)
    network.run(1.0)

    found = [(each.remote.guid[12:], each.policy) for each in talker.engine.mismatched()]

    assert found == [(reader, QosPolicy.DURABILITY)]
    assert listener.engine.mismatched() == []  # one of its readers matches the writer
    listener.engine.remove(reader, network.now)
    network.run(1.0)
    assert talker.engine.mismatched() == []


@pytest.mark.parametrize(("offered", "requested", "policy"), [
    (Qos(ReliabilityKind.BEST_EFFORT), Qos(), QosPolicy.RELIABILITY), (Qos(), LATCHED, QosPolicy.DURABILITY),
    (Qos(), Qos(deadline_s=1.0), QosPolicy.DEADLINE), (Qos(), Qos(lease_s=1.0), QosPolicy.LIVELINESS),
    (Qos(representations=(2,)), Qos(), QosPolicy.REPRESENTATION),
])  # fmt: skip
def test_a_mismatch_names_the_policy(offered: Qos, requested: Qos, policy: QosPolicy) -> None:
    network = SimulatedNetwork()
    talker, listener = network.host(), network.host()
    talker.engine.add_writer("rt/chatter", STRING, offered, network.now)
    listener.engine.add_reader("rt/chatter", STRING, requested, network.now)
    network.run(1.0)

    assert talker.policies() == listener.policies() == [policy]
    assert talker.matches() == listener.matches() == []


def test_another_type_on_the_topic_is_reported() -> None:
    network = SimulatedNetwork()
    talker, listener = network.host(), network.host()
    talker.engine.add_writer("rt/chatter", STRING, Qos(), network.now)
    listener.engine.add_reader("rt/chatter", STRING.replace("String", "Int8"), Qos(), network.now)
    network.run(1.0)

    assert talker.policies() == listener.policies() == [None]


def test_the_end_of_a_participant_is_announced() -> None:
    network = SimulatedNetwork()
    talker, _, listener, _ = pair(network, Qos(), Qos())
    talker.engine.close()
    network.flush()

    assert (listener.peers(), listener.matches()) == ([True, False], [True, False])


def test_a_silent_participant_ends_with_its_lease() -> None:
    network = SimulatedNetwork()
    talker, _, listener, _ = pair(network, Qos(), Qos())
    network.stop(talker)
    network.run(9.0)
    assert listener.peers() == [True]
    network.run(2.0)

    assert (listener.peers(), listener.matches()) == ([True, False], [True, False])


def test_the_end_of_an_endpoint_is_announced() -> None:
    network = SimulatedNetwork()
    talker, writer, listener, _ = pair(network, Qos(), Qos())
    talker.engine.remove(writer, network.now)
    network.flush()

    assert (listener.matches(), listener.peers()) == ([True, False], [True])


def test_remote_endpoints_can_be_looked_up() -> None:
    network = SimulatedNetwork()
    talker, writer, listener, _ = pair(network, Qos(), Qos())

    found = listener.engine.endpoint(talker.engine.prefix + writer)
    assert found is not None
    assert (found.topic, found.type_name) == ("rt/chatter", STRING)
    assert listener.engine.endpoint(bytes(16)) is None


def test_endpoints_beyond_the_limit_are_ignored_and_reported_once(constants: Constants) -> None:
    network = SimulatedNetwork()
    flooder = network.host()
    constants(ROS2_PEER_BYTES=100000)
    victim = network.host(Limits())
    for number in range(200):
        flooder.engine.add_writer(f"rt/flood{number}", STRING, Qos(), network.now)
    network.run(3.0)

    assert 10 < len(victim.endpoints()) < 50
    assert victim.refused() == 1


def test_endpoints_that_come_and_go_do_not_use_up_the_limit(constants: Constants) -> None:
    network = SimulatedNetwork()
    busy = network.host()
    constants(ROS2_PEER_BYTES=50000)
    other = network.host(Limits())
    for number in range(300):
        entity = busy.engine.add_writer(f"rt/topic{number}", STRING, Qos(), network.now)
        network.run(0.02)
        busy.engine.remove(entity, network.now)
        network.run(0.02)

    assert (other.refused(), len(other.endpoints())) == (0, 300)


def test_close_and_remove_may_be_repeated() -> None:
    network = SimulatedNetwork()
    talker, writer, _, _ = pair(network, Qos(), Qos())
    talker.engine.remove(writer, network.now)
    talker.engine.remove(writer, network.now)
    talker.engine.close()
    network.flush()
    sent = len(network.sent)
    talker.engine.close()
    talker.engine.poll(network.now + 100)
    network.flush()

    assert len(network.sent) == sent


def test_endpoints_that_are_added_later_match_at_once() -> None:
    network = SimulatedNetwork()
    talker, listener = network.host(), network.host()
    writer = talker.engine.add_writer("rt/chatter", STRING, Qos(), network.now)
    network.run(2.0)
    reader = listener.engine.add_reader("rt/chatter", STRING, Qos(), network.now)
    assert list(listener.engine.reader(reader).writers) == [talker.engine.prefix + writer]
    network.flush()

    assert talker.matches() == listener.matches() == [True]


def test_the_end_of_a_reader_is_announced() -> None:
    network = SimulatedNetwork()
    talker, writer, listener, reader = pair(network, DEEP, DEEP)
    network.drops = lambda datagram: b"lost" in datagram
    talker.engine.write(writer, b"lost", network.now)
    listener.engine.remove(reader, network.now)
    network.drops = lambda _: False
    network.run(1.0)

    assert talker.matches() == [True, False]
    assert talker.engine.writer(writer).is_acknowledged
    with pytest.raises(NotFound, match="reader"):
        listener.engine.reader(reader)


def test_a_removed_writer_refuses_samples() -> None:
    network = SimulatedNetwork()
    talker, writer, _, _ = pair(network, Qos(), Qos())
    talker.engine.remove(writer, network.now)

    with pytest.raises(NotFound, match="writer"):
        talker.engine.write(writer, b"late", network.now)


def test_a_writer_of_unlimited_depth_has_room_again_after_acknowledgments(constants: Constants) -> None:
    network = SimulatedNetwork()
    constants(ROS2_HISTORY_BYTES=10000)
    talker, listener = network.host(Limits()), network.host()
    endless = Qos(depth=0)
    entity = talker.engine.add_writer("rt/chatter", STRING, endless, network.now)
    reader = listener.engine.add_reader("rt/chatter", STRING, endless, network.now)
    network.run_until(lambda: bool(talker.matches() and listener.matches()))
    writer = talker.engine.writer(entity)
    network.drops = lambda _: True
    count = 0
    while writer.has_space(1000):
        talker.engine.write(entity, bytes(1000), network.now)
        count += 1
    network.flush()
    network.drops = lambda _: False
    network.run_until(lambda: len(listener.payloads(reader)) == count)
    network.run_until(lambda: writer.has_space(1000))

    assert 5 < count < 10
    assert writer.dropped == 0
    with pytest.raises(LimitExceeded, match="the limit is 10000 bytes"):
        talker.engine.write(entity, bytes(20_000), network.now)


def test_a_large_sample_that_is_no_longer_kept_is_skipped() -> None:
    """The reader asks for fragments of a sample that a newer one has displaced."""
    network = SimulatedNetwork()
    talker, writer, listener, reader = pair(network, Qos(depth=1), DEEP)
    second_part = [False]

    def drop_second_fragment(datagram: bytes) -> bool:
        is_fragment = len(datagram) > 40_000
        second_part[0] ^= is_fragment
        return is_fragment and not second_part[0]

    network.drops = drop_second_fragment
    talker.engine.write(writer, bytes(100_000), network.now)
    network.run(0.001)
    network.drops = lambda _: False
    talker.engine.write(writer, b"new.", network.now)
    network.run(2.0)

    assert (listener.payloads(reader), listener.engine.reader(reader).lost) == ([b"new."], 1)


def test_a_lost_answer_to_a_new_participant_is_repeated_soon() -> None:
    """Otherwise the new one would wait for the next announcement, up to three seconds."""
    network = SimulatedNetwork()
    talker = network.host()
    talker.engine.add_writer("rt/chatter", STRING, Qos(), network.now)
    network.run(4.0)
    listener = network.host()
    listener.engine.add_reader("rt/chatter", STRING, Qos(), network.now)
    from_talker = talker.engine.prefix
    network.drops = lambda datagram: datagram[8:20] == from_talker
    network.run(0.05)
    assert talker.peers() == [True]
    network.drops = lambda _: False
    network.run(1.0)

    assert listener.matches() == [True]


def submessages(datagram: bytes, to: Host) -> list[Submessage]:
    read = read_datagram(datagram, to.engine.prefix)
    return read.submessages if read else []


@pytest.mark.parametrize(("vendor", "base"), [(FAST_DDS, 0), (CYCLONE_DDS, 1)], ids=["Fast", "Cyclone"])
def test_heartbeats_are_asked_for_in_the_way_that_the_peer_answers(vendor: bytes, base: int) -> None:
    """Fast DDS ignores the question of the other form, and repeats its heartbeats only every 3 seconds."""
    network = SimulatedNetwork()
    peer = network.host(vendor=vendor)
    network.run(1.0)
    peer.engine.add_writer("rt/map", STRING, LATCHED, network.now)
    network.run(1.0)
    network.sent.clear()
    asking = network.host()
    asking.engine.add_reader("rt/map", STRING, LATCHED, network.now)
    network.run(1.0)
    found = [each for _, datagram in network.sent for each in submessages(datagram, peer)]
    questions = {each.base for each in found if isinstance(each, AckNack) and not each.is_final}

    assert (questions, asking.matches()) == ({base}, [True])


def test_a_participant_that_announces_itself_only_once_is_answered_repeatedly() -> None:
    """Cyclone DDS announces itself to the group every eight seconds, so a lost answer may not be repeated."""
    network = SimulatedNetwork()
    resident = network.host()
    resident.engine.add_writer("rt/map", STRING, LATCHED, network.now)
    network.run(10.0)
    visitor = network.host()
    seen: list[bytes] = []

    def is_lost(datagram: bytes) -> bool:
        """The first announcement of the visitor alone arrives, and no answer within 0.1 s."""
        is_announcement = any(each.writer == PARTICIPANT_WRITER for each in submessages(datagram, resident))
        if datagram[8:20] == visitor.engine.prefix and is_announcement:
            seen.append(datagram)
            return len(seen) > 1
        return network.now < begin + 0.1

    begin, network.drops = network.now, is_lost
    visitor.engine.add_reader("rt/map", STRING, LATCHED, network.now)
    network.run_until(lambda: visitor.matches() == [True], 1.5)


def test_a_participant_that_was_taken_for_dead_by_one_side_is_found_again() -> None:
    network = SimulatedNetwork()
    talker, listener = network.host(), network.host(lease_s=60.0)
    writer = talker.engine.add_writer("rt/map", STRING, LATCHED, network.now)
    reader = listener.engine.add_reader("rt/map", STRING, LATCHED, network.now)
    talker.engine.write(writer, b"map.", network.now)
    network.run_until(lambda: listener.payloads(reader) == [b"map."])
    network.run(1.0)
    network.drops = lambda datagram: datagram[8:20] == talker.engine.prefix  # the listener hears nothing
    network.run_until(lambda: listener.matches() == [True, False])
    assert talker.matches() == [True]
    network.drops = lambda _: False

    network.run_until(lambda: listener.payloads(reader) == [b"map.", b"map."])
