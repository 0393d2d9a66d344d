"""The links of one topic take turns, and poll longer for replies."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from pipros.net import incoming
from pipros.net.busy_poll import STREAM_POLL_S, PollingReceiver, PublishCount
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
        "name": "link", "delivery_lock": DeliveryLock(), "queue_size": None,
        "on_closed": lambda _, error: None, "published": PublishCount(), "received_count": PublishCount(),
    }  # fmt: skip
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


def test_a_link_polls_longer_for_the_next_message_after_the_node_has_published(monkeypatch) -> None:
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


def test_a_message_that_makes_the_buffer_grow_or_stalls_is_reported_until_it_is_complete(monkeypatch) -> None:
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


# Polling a socket briefly before a blocking read.


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket]]:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        yield ours, theirs


ONE_LOOK = -1.0  # a time that ends after the first poll


class SleepySocket:
    """A socket with bytes for blocking reads only, which records the kind of each read."""

    def __init__(self) -> None:
        self.waits: list[str] = []

    def recv_into(self, _room: memoryview, _most: int = 0, flags: int = 0) -> int:
        if flags:
            self.waits.append("looked")
            raise BlockingIOError
        self.waits.append("slept")
        return 1


@pytest.fixture
def sleepy() -> SleepySocket:
    return SleepySocket()


def wait_on(one: PollingReceiver, sock: SleepySocket) -> None:
    one.receive_into(sock, memoryview(b""))  # type: ignore[arg-type]


@pytest.mark.needs("MSG_DONTWAIT")
def test_the_number_of_polls_can_be_limited(sleepy: SleepySocket) -> None:
    PollingReceiver(60.0, may_poll=True).receive_into(sleepy, memoryview(b""), 3)  # type: ignore[arg-type]
    assert sleepy.waits == ["looked", "looked", "looked", "slept"]


def test_available_bytes_are_received(ends: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = ends
    buffer = bytearray(8)
    theirs.sendall(b"12345")
    assert PollingReceiver().receive_into(ours, memoryview(buffer)) == 5
    assert buffer[:5] == b"12345"
    theirs.sendall(b"12345")
    assert PollingReceiver().receive(ours, 3) == b"123"


def test_receive_waits_for_bytes_after_polling(ends: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = ends
    timer = threading.Timer(20 * STREAM_POLL_S, theirs.sendall, (b"late",))
    timer.start()
    assert PollingReceiver().receive(ours, 100) == b"late"
    timer.join()


def test_the_end_of_the_stream_returns_no_bytes(ends: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = ends
    theirs.close()
    assert PollingReceiver().receive(ours, 100) == b""
    assert PollingReceiver().receive_into(ours, memoryview(bytearray(1))) == 0


def test_a_deadline_ends_the_wait(ends: tuple[socket.socket, socket.socket]) -> None:
    with pytest.raises(TimeoutError):
        PollingReceiver().receive(ends[0], 100, deadline=time.monotonic() + 0.01)


def test_a_deadline_holds_for_a_peer_that_trickles(ends: tuple[socket.socket, socket.socket]) -> None:
    ends[1].sendall(b"more")
    with pytest.raises(TimeoutError):
        PollingReceiver().receive(ends[0], 1, deadline=time.monotonic() - 1)


@pytest.mark.needs("MSG_DONTWAIT")
def test_unsuccessful_polls_become_rare(sleepy: SleepySocket) -> None:
    one = PollingReceiver(ONE_LOOK, longest_pause=4, may_poll=True)
    polled_waits = []
    for wait in range(22):
        before = len(sleepy.waits)
        wait_on(one, sleepy)
        if "looked" in sleepy.waits[before:]:
            polled_waits.append(wait)
    assert polled_waits == [0, 2, 5, 10, 15, 20], "after one, two, four, four ... without"
    assert sleepy.waits.count("slept") == 22, "no wait ends without bytes"


@pytest.mark.needs("MSG_DONTWAIT")
def test_a_successful_poll_is_repeated(
    sleepy: SleepySocket, ends: tuple[socket.socket, socket.socket]
) -> None:
    one = PollingReceiver(ONE_LOOK, may_poll=True)
    for _ in range(5):  # polls, skips, polls, skips twice
        wait_on(one, sleepy)
    ends[1].sendall(b"here")
    assert one.receive(ends[0], 100) == b"here"
    sleepy.waits.clear()
    wait_on(one, sleepy)
    wait_on(one, sleepy)
    assert sleepy.waits == ["looked", "slept", "slept"], "the pause is one again"


def test_without_busy_polling_it_sleeps(sleepy: SleepySocket) -> None:
    wait_on(PollingReceiver(may_poll=False), sleepy)  # as on a machine with one processor
    assert sleepy.waits == ["slept"]
