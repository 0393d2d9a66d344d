"""The links of one topic take turns, and poll longer for replies."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from typing import Any

import pytest

from pipros.net import incoming
from pipros.net.busy_poll import PollingReceiver, PublishCount
from pipros.net.delivery_lock import DeliveryLock
from pipros.net.incoming import IncomingLink
from pipros.net.timings import LinkTimings
from tests.support.waiting import wait_until

FRAME = b"\x01\x00\x00\x00x"


def connected() -> tuple[socket.socket, socket.socket]:
    """Two ends of a connection."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        theirs = socket.create_connection(server.getsockname())
        return server.accept()[0], theirs


def link_of(sock: socket.socket, deliver: Callable[[Any], object], **changed: Any) -> IncomingLink:
    usual = {
        "name": "link",
        "delivery_lock": DeliveryLock(),
        "queue_size": None,
        "on_closed": lambda _, error: None,
        "published": PublishCount(),
        "received_count": PublishCount(),
    }
    return IncomingLink(sock, deliver=deliver, **{**usual, **changed})


@pytest.mark.parametrize("queue_size", [None, 100])
def test_a_link_with_a_backlog_lets_others_have_their_turn(queue_size: int | None) -> None:
    delivery_lock, began, order = DeliveryLock(), threading.Event(), list[str]()

    def make_link(name: str, received: bytes = b"") -> tuple[IncomingLink, socket.socket]:
        def deliver(_: object) -> None:
            order.append(name)
            began.set()
            if len(order) == 1:
                wait_until(delivery_lock.is_wanted, what="the other link")

        ours, theirs = connected()
        options = {"name": name, "delivery_lock": delivery_lock, "queue_size": queue_size}
        timings = LinkTimings(turn_s=-1.0)  # over with each message
        return link_of(ours, deliver, **options, received=received, timings=timings), theirs

    busy, to_busy = make_link("busy", 20 * FRAME)
    quiet, to_quiet = make_link("quiet")
    with to_busy, to_quiet:
        busy.start()
        to_busy.sendall(20 * FRAME)
        assert began.wait(30)
        quiet.start()
        to_quiet.sendall(FRAME)
        wait_until(lambda: len(order) == 41)
        assert order.index("quiet") == 1
    for link in (busy, quiet):
        link.join(30)


def test_a_link_polls_longer_for_the_next_message_after_the_node_has_published(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    published, delivered, polled = PublishCount(), list[bytes](), list[int | None]()
    receive = PollingReceiver.receive_into

    def receive_and_note(
        receiver: PollingReceiver, sock: socket.socket, buffer: memoryview, max_polls: int | None
    ) -> int:
        polled.append(max_polls)
        return receive(receiver, sock, buffer, max_polls)

    def deliver(message: memoryview | bytes) -> None:
        if message == b"q":
            published.value += 1
        delivered.append(bytes(message))

    monkeypatch.setattr(PollingReceiver, "receive_into", receive_and_note)
    ours, theirs = connected()
    link = link_of(ours, deliver, published=published)
    link.start()
    with theirs:
        for number, text in enumerate((b"a", b"b", b"q", b"c", b"d")):
            theirs.sendall(b"\x01\x00\x00\x00" + text)
            wait_until(lambda: len(delivered) > number)  # noqa: B023 # waited for in this round
    link.join(30)
    few = incoming.IDLE_POLLS
    assert polled[:6] == [few, few, few, None, few, few]


def test_a_link_that_keeps_messages_gets_large_ones_as_bytes() -> None:
    delivered = list[memoryview | bytes]()
    bodies = [bytes([number]) * 300_000 for number in range(5)]
    ours, theirs = connected()

    def deliver(data: memoryview | bytes) -> None:
        delivered.append(data if isinstance(data, bytes) else len(data).to_bytes(4, "big"))

    link = link_of(ours, deliver, keeps_large=True)
    with theirs:
        link.start()
        for number, body in enumerate(bodies, 1):
            theirs.sendall(len(body).to_bytes(4, "little") + body)
            wait_until(lambda number=number: len(delivered) == number, what=f"message {number}")
    link.join(30)
    assert delivered == [(300_000).to_bytes(4, "big"), *bodies[1:]]
    assert link.statistics.bytes == 5 * 300_004


def test_a_message_that_makes_the_buffer_grow_or_stalls_is_reported_until_it_is_complete(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(incoming, "KEEP_LARGE_S", 0.5)
    reported, delivered = list[int](), list[int]()
    ours, theirs = connected()
    deliver: Callable[[Any], None] = lambda data: delivered.append(len(data))  # noqa: E731
    link = link_of(ours, deliver, on_incomplete=lambda _, count: reported.append(count))
    with theirs:
        link.start()
        theirs.sendall((1_000_000).to_bytes(4, "little") + bytes(900_000))
        wait_until(lambda: bool(reported) and reported[-1] > 400_000)
        # At once, for the memory of a large message is freed if no other one begins meanwhile.
        theirs.sendall(bytes(100_000) + (1_000_000).to_bytes(4, "little") + bytes(4))
        wait_until(lambda: 0 in reported and reported[-1] > 400_000)
        assert delivered == [1_000_000]
    link.join(30)
    assert reported[-1] == 0
