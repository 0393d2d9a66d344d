"""pipros with Fast DDS and Cyclone DDS: topics, services and actions, both ways, restarts and loss.

Each cell of the table in docs/internals/rtps.md has a quick test here. Those with lost datagrams are for two
kinds of peers; `long_matrix.py` has all of them, and the longer runs.
"""

import re
import signal

import pytest

from tests.support import dds_peers
from tests.support.dds_peers import Peers
from tests.support.network import needs_network
from tests.support.processes import Process
from tests.support.waiting import wait_until

pytestmark = [needs_network, pytest.mark.timeout(300)]  # the first test compiles the peers

TOPIC = "rt/chatter"
BOTH = ["fast-udp", "cyclone"]
WHEEL = ["cyclone-wheel"] if dds_peers.WHEEL else []
ALL = [*BOTH, "fast-shm", *WHEEL]


def received(reader: Process) -> list[int]:
    """Return the numbers of the messages that a subscriber printed, after checking their content.

    The last line of a killed subscriber may be incomplete.
    """
    assert not any(line.startswith("wrong") for line in reader.stdout)
    found = [re.fullmatch(r"got (\d+) \d+", line) for line in list(reader.stdout)]
    return [int(each[1]) for each in found if each]


def wait_for_all(reader: Process, count: int, timeout_s: float = 90.0) -> None:
    wait_until(lambda: len(received(reader)) >= count, timeout_s, lambda: reader.output[-300:])
    assert received(reader) == list(range(count))


def publish(peers: Peers, kind: str, count: int, size: int, period_us: int, how: str = "reliable") -> Process:
    return peers.start(kind, "pub", TOPIC, count, size, period_us, how)


def subscribe(peers: Peers, kind: str, how: str = "reliable") -> Process:
    reader = peers.start(kind, "sub", TOPIC, how)
    reader.wait_for("ready")
    return reader


@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("how", ["out", "in"])
@pytest.mark.parametrize(("count", "size", "period_us"), [(300, 99, 1000), (10, 1_000_000, 20_000)])
def test_topics_of_either_side_arrive_whole(
    peers: Peers, kind: str, how: str, count: int, size: int, period_us: int
) -> None:
    writer, reader = ("SUBNET", kind) if how == "out" else (kind, "SUBNET")
    listening = subscribe(peers, reader)
    publish(peers, writer, count, size, period_us)
    wait_for_all(listening, count)


@pytest.mark.parametrize("kind", ["fast-udp", "cyclone-localhost"])
@pytest.mark.parametrize("how", ["out", "in"])
def test_participants_find_each_other_without_multicast(peers: Peers, kind: str, how: str) -> None:
    here, there = ("LOCALHOST", kind) if how == "in" else (kind, "LOCALHOST")
    reader = subscribe(peers, here)
    publish(peers, there, 50, 10, 1000)
    wait_for_all(reader, 50)


@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("how", ["out", "in"])
def test_a_late_subscriber_gets_the_latched_message(peers: Peers, kind: str, how: str) -> None:
    writer, reader = ("SUBNET", kind) if how == "out" else (kind, "SUBNET")
    publish(peers, writer, 3, 100, 0, "latched").wait_for("published")
    late = subscribe(peers, reader, "latched")
    late.wait_for("got 2 100", 60)

    assert received(late) == [2]


@pytest.mark.parametrize("kind", ALL)
def test_a_peer_calls_a_service_of_pipros(peers: Peers, kind: str) -> None:
    peers.start("SUBNET", "server", "/add").wait_for("ready")
    caller = peers.start(kind, "client", "/add", 100)
    caller.wait_for("^right 100$", 60)

    assert "reply for another" not in caller.output


@pytest.mark.parametrize("kind", ALL)
def test_pipros_calls_a_service_of_a_peer(peers: Peers, kind: str) -> None:
    peers.start(kind, "server", "/add").wait_for("ready")
    peers.start("SUBNET", "client", "/add", 100).wait_for("^right 100$", 60)


@pytest.mark.parametrize("kind", BOTH)
@pytest.mark.parametrize("role", ["server", "client"])
def test_goals_of_actions_succeed_and_are_cancelled_and_rejected(peers: Peers, kind: str, role: str) -> None:
    server, client = ("SUBNET", kind) if role == "server" else (kind, "SUBNET")
    peers.start(server, "action-server", "/fibonacci").wait_for("ready")
    ends = {
        (8, "finish"): ["accepted 1", "feedback 8", "status 4", "result 4: 0 1 1 2 3 5 8 13"],
        (40, "cancel"): ["accepted 1", "cancelling 0 of 1", "status 5", "result 5:"],
        (-1, "finish"): ["accepted 0"],
    }
    callers = [peers.start(client, "action-client", "/fibonacci", *words) for words in ends]
    for caller, lines in zip(callers, ends.values(), strict=True):
        for line in lines:
            caller.wait_for(f"^{line}$", timeout_s=60)


def test_one_server_answers_clients_of_all_kinds_at_once(peers: Peers) -> None:
    """Neither rmw can do this: a reply goes to its client alone, in the client's style."""
    server = peers.start("SUBNET", "server", "/add")
    server.wait_for("ready")
    kinds = ["fast-udp", "cyclone", "SUBNET", "fast-udp", "cyclone"]
    callers = [peers.start(kind, "client", "/add", 60) for kind in kinds]
    for caller in callers:
        caller.wait_for("^right 60$", timeout_s=60)

    assert not any("reply for another" in caller.output for caller in callers)
    assert "Traceback" not in server.output


@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("how", ["out", "in"])
def test_either_side_may_end_and_start_again(peers: Peers, kind: str, how: str) -> None:
    writer, reader = ("SUBNET", kind) if how == "out" else (kind, "SUBNET")

    def publish_to(listening: Process) -> Process:
        before = listening.mark()
        publisher = publish(peers, writer, 20, 10, 1000)
        listening.wait_for("^got 19 ", since=before)
        return publisher

    def end(process: Process) -> None:
        process.end_input()
        assert process.wait() == 0

    first = subscribe(peers, reader)
    end(publish_to(first))
    publish_to(first)
    end(first)
    second = subscribe(peers, reader)
    publish_to(second)

    assert received(first) == [*range(20), *range(20)]
    assert received(second) == list(range(20))


@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("how", ["out", "in"])
def test_either_side_may_be_killed_and_started_again(peers: Peers, kind: str, how: str) -> None:
    writer, reader = ("SUBNET", kind) if how == "out" else (kind, "SUBNET")
    first = subscribe(peers, reader)
    publisher = publish(peers, writer, 100_000, 10, 20_000)  # so slowly that a busy reader misses none
    first.wait_for("got 20 ")
    first.send_signal(signal.SIGKILL)
    second = subscribe(peers, reader)
    second.wait_for("^got")
    publisher.send_signal(signal.SIGKILL)
    before = second.mark()
    publish(peers, writer, 100_000, 10, 20_000)
    second.wait_for("^got 5 ", since=before)


@pytest.mark.parametrize("kind", BOTH)
@pytest.mark.parametrize("how", ["out", "in"])
def test_nothing_is_lost_when_datagrams_are(peers: Peers, kind: str, how: str) -> None:
    """One in twenty of the datagrams to and from pipros is dropped, whatever it contains."""
    lossy = "SUBNET,loss=0.05"
    writer, reader = (lossy, kind) if how == "out" else (kind, lossy)
    listening = subscribe(peers, reader)
    publish(peers, writer, 1000, 100, 1000)
    wait_for_all(listening, 1000)


@pytest.mark.parametrize("kind", BOTH)
def test_large_messages_arrive_when_fragments_are_lost(peers: Peers, kind: str) -> None:
    reader = subscribe(peers, kind)
    publish(peers, "SUBNET,loss=0.05", 10, 2_000_000, 50_000)
    wait_for_all(reader, 10)
