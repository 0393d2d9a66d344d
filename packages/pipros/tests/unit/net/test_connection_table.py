"""The choice of the connections to close beyond the limits, and the counters."""

import pytest

from pipros.net.connection_table import ConnectionTable
from pipros.net.held_bytes import HeldBytes
from pipros.net.refusals import Refusals


class Peer:
    def __init__(self, address: str, last_used: float = 0) -> None:
        self.peer = address
        self.last_used = last_used
        self.is_closed = False

    def abort(self) -> None:
        self.is_closed = True


def table_of(limit: int, per_peer: int = 100) -> ConnectionTable:
    return ConnectionTable(limit=limit, limit_per_peer=per_peer, refusals=Refusals())


def test_the_connection_idle_longest_is_closed_first() -> None:
    connections = table_of(2)
    first, second, third = Peer("a"), Peer("b"), Peer("c")
    connections.add(first)
    connections.add(second)
    connections.mark_used(first)
    connections.add(third)
    assert [peer.is_closed for peer in (first, second, third)] == [False, True, False]
    assert (len(connections), connections.accepted, connections.evicted) == (2, 3, 1)


def test_a_peer_with_too_many_links_loses_only_its_own() -> None:
    connections = table_of(100, per_peer=2)
    other, *greedy = Peer("other"), Peer("greedy"), Peer("greedy"), Peer("greedy")
    for peer in (other, *greedy):
        connections.add(peer)
    assert [peer.is_closed for peer in (other, *greedy)] == [False, True, False, False]


def test_a_peer_may_be_limited_to_a_single_connection() -> None:
    connections = table_of(100, per_peer=1)
    first, second = Peer("a"), Peer("a")
    connections.add(first)
    connections.add(second)
    connections.remove(second)
    assert first.is_closed
    assert len(connections) == 0


def test_deadlines_are_kept_in_order_and_not_moved() -> None:
    connections = table_of(10)
    slow, slower = Peer("a"), Peer("b")
    for peer in (slow, slower):
        connections.add(peer)
    connections.set_deadline(slow, 10)
    connections.set_deadline(slower, 20)
    connections.set_deadline(slow, 99)
    connections.close_overdue(15, idle_s=1000)
    assert (slow.is_closed, slower.is_closed) == (True, False)
    connections.clear_deadline(slower)
    connections.close_overdue(25, idle_s=1000)
    assert not slower.is_closed


def test_idle_connections_are_closed_after_their_time() -> None:
    connections = table_of(10)
    old, recent = Peer("a", last_used=0), Peer("b", last_used=50)
    for peer in (old, recent):
        connections.add(peer)
    connections.close_overdue(60, idle_s=30)
    assert (old.is_closed, recent.is_closed) == (True, False)


def test_removal_may_be_repeated_and_later_use_has_no_effect() -> None:
    connections = table_of(10)
    peer = Peer("a")
    connections.add(peer)
    connections.remove(peer)
    connections.remove(peer)
    connections.mark_used(peer)
    assert len(connections) == 0


def test_all_refusals_are_counted_and_the_first_of_a_peer_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals()
    for peer in ("a", "a", "b"):
        refusals.count(peer, "sent nonsense")
    assert (refusals.total, refusals.by_peer()) == (3, {"a": 2, "b": 1})
    assert [record.message.split(":")[0] for record in caplog.records] == ["refused a", "refused b"]


def test_a_million_peers_do_not_fill_the_memory_or_the_log(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals()
    for number in range(20_000):
        refusals.count(str(number), "sent nonsense")
    assert refusals.total == 20_000
    assert len(refusals.by_peer()) == len(caplog.records) == 10_000


def test_a_busy_connection_is_not_closed_for_others() -> None:
    connections = table_of(2)
    busy, idle, new = Peer("a"), Peer("b"), Peer("c")
    connections.add(busy)
    connections.add(idle)
    connections.mark_busy(busy)
    assert connections.add(new)
    connections.mark_busy(new)
    assert (busy.is_closed, idle.is_closed) == (False, True)
    assert not connections.add(Peer("d"))
    connections.mark_used(busy)
    assert connections.add(Peer("e"))
    assert busy.is_closed


def test_a_busy_connection_has_no_deadline() -> None:
    connections = table_of(2)
    busy = Peer("a")
    connections.add(busy)
    connections.set_deadline(busy, 10)
    connections.mark_busy(busy)
    connections.close_overdue(20, idle_s=1000)
    assert not busy.is_closed


def test_a_new_link_replaces_the_newest_of_the_peer_with_the_most() -> None:
    connections = table_of(4)  # less than one of which is for calls
    other, *links = Peer("other"), Peer("a"), Peer("a"), Peer("a")
    for link in (*links, other):
        assert connections.add_link(link)
    assert connections.add_link(Peer("other"))
    assert [link.is_closed for link in (other, *links)] == [False, False, False, True]


def test_the_log_says_whether_an_idle_connection_or_a_link_was_closed(caplog) -> None:
    connections = table_of(100, per_peer=1)
    for _ in range(2):
        connections.add(Peer("caller"))
        connections.add_link(Peer("subscriber"))
    assert [record.getMessage().partition(" (")[0] for record in caplog.records] == [
        "refused caller: too many connections; the connection idle longest was closed to make room",
        "refused subscriber: too many connections; the newest link was closed to make room",
    ]


def test_calls_do_not_close_links() -> None:
    connections = table_of(2)
    links = [Peer("a"), Peer("a")]
    for link in links:
        connections.add_link(link)
    assert not connections.add(Peer("b"))
    assert not any(link.is_closed for link in links)


def test_outgoing_links_leave_room_for_links_and_calls_of_peers() -> None:
    connections = table_of(16)
    assert [connections.reserve_outgoing(limit=100) for _ in range(20)].count(True) == 12
    links = [Peer("a"), Peer("a"), Peer("a")]
    for link in links:
        assert connections.add_link(link)
    assert [link.is_closed for link in links] == [False, True, False]
    calls = [Peer("a"), Peer("a"), Peer("a")]
    for call in calls:
        assert connections.add(call)
    assert [call.is_closed for call in calls] == [True, False, False]
    connections.release_outgoing()
    assert connections.reserve_outgoing(limit=100)
    assert not connections.reserve_outgoing(limit=12)


def test_the_nodes_of_this_machine_share_an_address_and_are_spared() -> None:
    connections = ConnectionTable(limit=10, limit_per_peer=2, refusals=Refusals(), spares_loopback=True)
    local, remote = ([Peer(address) for _ in range(4)] for address in ("127.0.0.1", "10.0.0.1"))
    for peer in (*local, *remote):
        connections.add(peer)
    assert [peer.is_closed for peer in local] == [False] * 4
    assert [peer.is_closed for peer in remote] == [True, True, False, False]


def test_the_oldest_request_is_closed_first() -> None:
    bodies = HeldBytes(limit_bytes=100, refusals=Refusals())
    first, second, third = Peer("a"), Peer("b"), Peer("c")
    bodies.note(first, 40)
    bodies.note(second, 40)
    bodies.note(first, 60)
    assert not first.is_closed
    bodies.note(third, 1)
    bodies.note(first, 80)  # its thread read more before it noticed
    assert (first.is_closed, second.is_closed, third.is_closed, bodies.bytes) == (True, False, False, 41)
    bodies.forget(first)
    bodies.note(first, 50)
    bodies.forget(first)
    bodies.forget(second)
    bodies.forget(second)
    assert bodies.bytes == 1


def test_further_refusals_are_reported_later(caplog: pytest.LogCaptureFixture) -> None:
    rare, at_once = Refusals(), Refusals(report_every_s=0.0)
    for _ in range(100):
        rare.count("a", "sent nonsense")
    rare.report()
    assert len(caplog.records) == 1
    caplog.clear()
    for _ in range(100):
        at_once.count("a", "sent nonsense")
    at_once.report()
    at_once.report()
    assert [record.getMessage() for record in caplog.records[1:]] == ["99 more refusals, 100 in total"]
