"""Who has to leave when there are too many, and who is counted."""

from __future__ import annotations

import pytest

from pipros.net.connections import Connections, Refusals


class Peer:
    def __init__(self, address: str, last_used: float = 0) -> None:
        self.peer = address
        self.last_used = last_used
        self.is_closed = False

    def abort(self) -> None:
        self.is_closed = True


def room_for(limit: int, per_peer: int = 100) -> Connections:
    return Connections(limit=limit, limit_per_peer=per_peer, refusals=Refusals())


def test_the_one_idle_longest_gives_way() -> None:
    connections = room_for(2)
    first, second, third = Peer("a"), Peer("b"), Peer("c")
    connections.enter(first)
    connections.enter(second)
    connections.touch(first)
    connections.enter(third)
    assert [peer.is_closed for peer in (first, second, third)] == [False, True, False]
    assert (len(connections), connections.accepted, connections.closed_for_room) == (2, 3, 1)


def test_a_peer_with_too_many_loses_its_own_and_nobody_elses() -> None:
    connections = room_for(100, per_peer=2)
    other, *greedy = Peer("other"), Peer("greedy"), Peer("greedy"), Peer("greedy")
    for peer in (other, *greedy):
        connections.enter(peer)
    assert [peer.is_closed for peer in (other, *greedy)] == [False, True, False, False]


def test_one_peer_may_be_limited_to_a_single_connection() -> None:
    connections = room_for(100, per_peer=1)
    first, second = Peer("a"), Peer("a")
    connections.enter(first)
    connections.enter(second)
    connections.leave(second)
    assert first.is_closed
    assert len(connections) == 0


def test_deadlines_are_kept_in_order_and_not_moved() -> None:
    connections = room_for(10)
    slow, slower = Peer("a"), Peer("b")
    for peer in (slow, slower):
        connections.enter(peer)
    connections.expect_by(slow, 10)
    connections.expect_by(slower, 20)
    connections.expect_by(slow, 99)
    connections.sweep(15, idle_s=1000)
    assert (slow.is_closed, slower.is_closed) == (True, False)
    connections.expect_nothing(slower)
    connections.sweep(25, idle_s=1000)
    assert not slower.is_closed


def test_idle_connections_are_swept_after_their_time() -> None:
    connections = room_for(10)
    old, recent = Peer("a", last_used=0), Peer("b", last_used=50)
    for peer in (old, recent):
        connections.enter(peer)
    connections.sweep(60, idle_s=30)
    assert (old.is_closed, recent.is_closed) == (True, False)


def test_leaving_twice_and_being_touched_after_it_is_harmless() -> None:
    connections = room_for(10)
    peer = Peer("a")
    connections.enter(peer)
    connections.leave(peer)
    connections.leave(peer)
    connections.touch(peer)
    assert len(connections) == 0


def test_all_refusals_are_counted_and_the_first_of_a_peer_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals()
    for peer in ("a", "a", "b"):
        refusals.note(peer, "sent nonsense")
    assert refusals.total == 3
    assert refusals.by_peer() == {"a": 2, "b": 1}
    assert [record.message.split(":")[0] for record in caplog.records] == ["refused a", "refused b"]


def test_a_million_peers_do_not_fill_the_memory_or_the_log(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals()
    for number in range(20_000):
        refusals.note(str(number), "sent nonsense")
    assert refusals.total == 20_000
    assert len(refusals.by_peer()) == len(caplog.records) == 10_000
