"""Datagrams that have been read but not yet handled."""

from __future__ import annotations

import math
import socket
from collections.abc import Iterator

import pytest

from pipros_ros2.rtps.sockets import SocketBacklog


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Two sockets, of which the first one sends to the second one."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sending,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiving,
    ):
        receiving.bind(("127.0.0.1", 0))
        receiving.setblocking(False)
        sending.connect(receiving.getsockname())
        yield sending, receiving


def test_datagrams_are_returned_in_their_order(ends: tuple[socket.socket, socket.socket]) -> None:
    backlog = SocketBacklog(10_000)
    for number in range(3):
        ends[0].send(b"%d" % number)
    backlog.read([ends[1]], 1.0)

    assert [backlog.next() for _ in range(4)] == [
        *((b"%d" % number, "127.0.0.1") for number in range(3)),
        None,
    ]
    assert not backlog


def test_datagrams_that_were_not_returned_are_not_handled(ends: tuple[socket.socket, socket.socket]) -> None:
    backlog = SocketBacklog(10_000)
    assert backlog.handled_until == -math.inf
    ends[0].send(b"one")
    backlog.read([ends[1]], 1.0)
    ends[0].send(b"two")
    backlog.read([ends[1]], 2.0)
    found = [backlog.handled_until]
    for _ in range(2):
        backlog.next()
        found.append(backlog.handled_until)

    assert found == [1.0, 2.0, 2.0]


def test_a_flood_of_one_sender_delays_and_displaces_only_its_own_datagrams(
    ends: tuple[socket.socket, socket.socket],
) -> None:
    backlog = SocketBacklog(5_000)
    for _ in range(20):
        ends[0].send(bytes(300))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(b"mine", ends[1].getsockname())
    backlog.read([ends[1]], 1.0)

    found = []
    while (datagram := backlog.next()) is not None:
        found.append(datagram[0])
    assert found[1] == b"mine"
    assert len(found) == 1 + 5  # half of the limit
    assert backlog.handled_until == 1.0
