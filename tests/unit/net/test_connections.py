"""Who has to leave when there are too many, and who is counted."""

from __future__ import annotations

import pytest

from pipros.net.connections import Connections, HeldBytes, Refusals


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
        refusals.count(peer, "sent nonsense")
    assert refusals.total == 3
    assert refusals.by_peer() == {"a": 2, "b": 1}
    assert [record.message.split(":")[0] for record in caplog.records] == ["refused a", "refused b"]


def test_a_million_peers_do_not_fill_the_memory_or_the_log(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals()
    for number in range(20_000):
        refusals.count(str(number), "sent nonsense")
    assert refusals.total == 20_000
    assert len(refusals.by_peer()) == len(caplog.records) == 10_000


def test_a_connection_that_is_held_does_not_give_way() -> None:
    connections = room_for(2)
    busy, idle, new = Peer("a"), Peer("b"), Peer("c")
    connections.enter(busy)
    connections.enter(idle)
    connections.hold(busy)
    assert connections.enter(new)
    connections.hold(new)
    assert (busy.is_closed, idle.is_closed) == (False, True)
    assert not connections.enter(Peer("d"))
    connections.touch(busy)
    assert connections.enter(Peer("e"))
    assert busy.is_closed


def test_what_is_expected_of_a_connection_waits_while_it_is_held() -> None:
    connections = room_for(2)
    busy = Peer("a")
    connections.enter(busy)
    connections.expect_by(busy, 10)
    connections.hold(busy)
    connections.sweep(20, idle_s=1000)
    assert not busy.is_closed


def test_a_new_link_takes_the_place_of_the_newest_of_the_peer_with_the_most() -> None:
    connections = room_for(4)  # of which less than one is for calls
    other, *links = Peer("other"), Peer("a"), Peer("a"), Peer("a")
    for link in (*links, other):
        assert connections.enter_link(link)
    assert connections.enter_link(Peer("other"))
    assert [link.is_closed for link in (other, *links)] == [False, False, False, True]


def test_no_link_gives_way_to_a_call() -> None:
    connections = room_for(2)
    links = [Peer("a"), Peer("a")]
    for link in links:
        connections.enter_link(link)
    assert not connections.enter(Peer("b"))
    assert not any(link.is_closed for link in links)


def test_links_that_are_made_leave_room_for_links_and_calls_of_peers() -> None:
    connections = room_for(16)
    assert [connections.reserve(most=100) for _ in range(20)].count(True) == 12
    links = [Peer("a"), Peer("a"), Peer("a")]
    for link in links:
        assert connections.enter_link(link)
    assert [link.is_closed for link in links] == [False, True, False]
    calls = [Peer("a"), Peer("a"), Peer("a")]
    for call in calls:
        assert connections.enter(call)
    assert [call.is_closed for call in calls] == [True, False, False]
    connections.give_back()
    assert connections.reserve(most=100)
    assert not connections.reserve(most=12)


def test_the_nodes_of_this_machine_share_an_address_and_are_spared() -> None:
    connections = Connections(limit=10, limit_per_peer=2, refusals=Refusals(), spares_loopback=True)
    local, remote = ([Peer(address) for _ in range(4)] for address in ("127.0.0.1", "10.0.0.1"))
    for peer in (*local, *remote):
        connections.enter(peer)
    assert [peer.is_closed for peer in local] == [False] * 4
    assert [peer.is_closed for peer in remote] == [True, True, False, False]


def test_the_request_that_began_first_gives_way_to_the_others() -> None:
    bodies = HeldBytes(limit_bytes=100, refusals=Refusals())
    first, second, third = Peer("a"), Peer("b"), Peer("c")
    bodies.note(first, 40)
    bodies.note(second, 40)
    bodies.note(first, 60)
    assert not first.is_closed
    bodies.note(third, 1)
    assert (first.is_closed, second.is_closed, third.is_closed) == (True, False, False)
    assert bodies.bytes == 41
    bodies.forget(second)
    bodies.forget(second)
    assert bodies.bytes == 1


def test_what_was_refused_since_is_said_later(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    refusals = Refusals()
    for _ in range(100):
        refusals.count("a", "sent nonsense")
    refusals.report()
    assert len(caplog.records) == 1
    monkeypatch.setattr("pipros.net.connections._REPORT_EVERY_S", 0)
    refusals.report()
    refusals.report()
    assert [record.getMessage() for record in caplog.records[1:]] == [
        "refused 99 more, of 100 since the start"
    ]
