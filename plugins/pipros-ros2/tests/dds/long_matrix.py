"""The cells of `test_dds_matrix.py` with more messages and restarts, and with all kinds of peers."""

import signal

import pytest

from tests.dds.test_dds_matrix import ALL, publish, received, subscribe, wait_for_all
from tests.support.dds_peers import Peers
from tests.support.network import needs_network

pytestmark = needs_network

LOSSY = "SUBNET,loss=0.05"
BOTH_WAYS = pytest.mark.parametrize("how", ["out", "in"])
ALL_KINDS = pytest.mark.parametrize("kind", ALL)


def ends(how: str, ours: str, kind: str) -> tuple[str, str]:
    """The writer and the reader."""
    return (ours, kind) if how == "out" else (kind, ours)


@ALL_KINDS
@BOTH_WAYS
@pytest.mark.parametrize("ours", ["SUBNET", LOSSY])
@pytest.mark.parametrize(("count", "size", "period_us"), [(10_000, 100, 1000), (100, 1_000_000, 50_000)])
def test_many_messages_arrive(
    peers: Peers, kind: str, how: str, ours: str, count: int, size: int, period_us: int
) -> None:
    writer, reader = ends(how, ours, kind)
    listening = subscribe(peers, reader)
    publish(peers, writer, count, size, period_us)
    wait_for_all(listening, count, 120.0)


@ALL_KINDS
@BOTH_WAYS
def test_latched_messages_arrive_with_loss(peers: Peers, kind: str, how: str) -> None:
    writer, reader = ends(how, LOSSY, kind)
    publish(peers, writer, 3, 100_000, 0, "latched").wait_for("published")
    for _ in range(10):
        late = subscribe(peers, reader, "latched")
        late.wait_for("^got 2 ")
        assert received(late) == [2]
        late.end_input()
        assert late.wait() == 0


@ALL_KINDS
@pytest.mark.parametrize("ours", ["SUBNET", LOSSY])
@pytest.mark.parametrize("role", ["server", "client"])
def test_all_calls_get_their_reply(peers: Peers, kind: str, ours: str, role: str) -> None:
    server, client = (ours, kind) if role == "server" else (kind, ours)
    peers.start(server, "server", "/add").wait_for("ready")
    count = 50 if ours == LOSSY else 1000  # Fast DDS repeats its heartbeats only every three seconds
    caller = peers.start(client, "client", "/add", count)
    caller.wait_for(f"^right {count}$", timeout_s=120)

    assert "reply for another" not in caller.output


@ALL_KINDS
@BOTH_WAYS
@pytest.mark.parametrize("is_killed", [False, True])
def test_readers_may_come_and_go(peers: Peers, kind: str, how: str, is_killed: bool) -> None:
    writer, reader = ends(how, "SUBNET", kind)
    publish(peers, writer, 1_000_000, 10, 1000)
    for _ in range(20):
        visitor = subscribe(peers, reader)
        visitor.wait_for("^got")
        if is_killed:
            visitor.send_signal(signal.SIGKILL)
        else:
            visitor.end_input()
        visitor.wait()
        numbers = received(visitor)
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


@ALL_KINDS
@BOTH_WAYS
@pytest.mark.parametrize("is_killed", [False, True])
def test_writers_may_come_and_go(peers: Peers, kind: str, how: str, is_killed: bool) -> None:
    writer, reader = ends(how, "SUBNET", kind)
    listening = subscribe(peers, reader)
    for _ in range(20):
        before = listening.mark()
        publisher = publish(peers, writer, 20, 10, 1000)
        listening.wait_for("^got 19 ", since=before)
        if is_killed:
            publisher.send_signal(signal.SIGKILL)
        else:
            publisher.end_input()
        publisher.wait()

    assert received(listening) == list(range(20)) * 20
