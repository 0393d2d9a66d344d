"""The sending end of a link, with a socket in memory: written, queued and dropped messages, and waits."""

import socket
import sys
from collections.abc import Callable
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.net import sockets
from pipros.net.outgoing import CHECK_STALLED_INTERVAL_S, TURN_BYTES, OutgoingLink
from tests.support.constants import Constants

SIZE = 10


class Socket:
    """Accepts `space` bytes, then none until a test sets `space` again."""

    family = socket.AF_INET

    def __init__(self) -> None:
        self.space = 0
        self.most_at_once = sys.maxsize
        self.sent = b""
        self.is_reset = False
        self.is_closed = False
        self.incoming: list[bytes] = []

    def fileno(self) -> int:
        return 7

    def send(self, data: bytes | memoryview) -> int:
        if self.is_reset:
            raise ConnectionResetError
        count = min(len(data), self.space, self.most_at_once)
        if not count:
            raise BlockingIOError
        self.sent += bytes(data[:count])
        self.space -= count
        return count

    def sendmsg(self, buffers: list[bytes | memoryview]) -> int:
        return self.send(b"".join(buffers))

    def recv(self, _most: int) -> bytes:
        if not self.incoming:
            raise BlockingIOError
        return self.incoming.pop(0)

    def getpeername(self) -> tuple[str, int]:
        return "10.0.0.9", 4711

    def setblocking(self, _flag: bool) -> None:
        pass

    def shutdown(self, _how: int) -> None:
        pass

    def close(self) -> None:
        self.is_closed = True


class Timer:
    def cancel(self) -> None:
        pass


class Loop:
    """A background loop driven by the test: `call`, and the timers and watches of asyncio."""

    def __init__(self) -> None:
        self.asyncio = self
        self.soon: list[Callable[[], object]] = []
        self.timers: list[tuple[float, Callable[[], object]]] = []
        self.reader: Callable[[], object] | None = None
        self.writer: Callable[[], object] | None = None

    def call(self, function: Callable[..., object], *args: object) -> None:
        self.soon.append(lambda: function(*args))

    def call_later(self, delay_s: float, function: Callable[[], object]) -> Timer:
        self.timers.append((delay_s, function))
        return Timer()

    def add_reader(self, _sock: object, function: Callable[[], object]) -> None:
        self.reader = function

    def add_writer(self, _sock: object, function: Callable[[], object]) -> None:
        self.writer = function

    def remove_reader(self, _sock: object) -> None:
        self.reader = None

    def remove_writer(self, _sock: object) -> None:
        self.writer = None

    def run(self) -> None:
        while self.soon:
            self.soon.pop(0)()

    def fire(self, delay_s: float) -> None:
        """Call the timers of one kind once."""
        due = [function for delay, function in self.timers if delay == delay_s]
        self.timers = [timer for timer in self.timers if timer[0] != delay_s]
        for function in due:
            function()


class Subscriber:
    """A link with its socket and loop."""

    def __init__(self, queue_size: int | None, limits: Limits | None = None) -> None:
        self.sock, self.loop = Socket(), Loop()
        self.ended: list[OutgoingLink] = []
        sock: Any = self.sock
        self.link = OutgoingLink(
            sock, self.loop, queue_size=queue_size, limits=limits or Limits(), on_closed=self.ended.append
        )
        self.loop.run()

    def send(self, *numbers: int) -> None:
        for number in numbers:
            self.link.send((str(number).encode() * SIZE,), SIZE)

    def leave_to_loop(self) -> None:
        self.link.queue_for_loop()
        self.loop.run()

    def allow(self, space: int) -> None:
        """Let the subscriber read, so that the loop finds the socket writable."""
        self.sock.space = space
        if self.loop.writer:
            self.loop.writer()

    @property
    def messages(self) -> str:
        """The digits of the sent messages, one for each complete message."""
        sent = self.sock.sent.decode()
        return "".join(sent[start] for start in range(0, len(sent) - SIZE + 1, SIZE))


@pytest.fixture(autouse=True)
def drained(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """The reply of the system about drained sockets; a test empties the list to simulate undrained ones."""
    answers = [True]
    monkeypatch.setattr(sockets, "is_nearly_drained", lambda _sock: bool(answers))
    monkeypatch.setattr(sockets, "is_unanswered", lambda _sock, _limit_s: False)
    return answers


def test_a_message_is_written_at_once_while_the_socket_has_room() -> None:
    subscriber = Subscriber(10)
    subscriber.sock.space = 100
    subscriber.send(1, 2)
    assert subscriber.messages == "12"
    assert not subscriber.link.is_behind
    assert (subscriber.link.statistics.frames, subscriber.link.statistics.bytes) == (2, 2 * SIZE)


def test_with_a_full_socket_the_newest_messages_wait_and_the_oldest_are_dropped() -> None:
    subscriber = Subscriber(2)
    subscriber.send(1, 2, 3, 4)
    subscriber.leave_to_loop()
    subscriber.allow(100)
    assert subscriber.messages == "34"
    assert (subscriber.link.statistics.frames, subscriber.link.statistics.dropped) == (2, 2)
    assert subscriber.loop.writer is None, "nothing waits, so the socket is not watched"


def test_the_rest_of_a_message_is_sent_even_if_later_messages_are_dropped() -> None:
    subscriber = Subscriber(1)
    subscriber.sock.space = 4
    subscriber.send(1, 2, 3)
    subscriber.leave_to_loop()
    subscriber.allow(3)
    subscriber.allow(100)
    assert (subscriber.sock.sent, subscriber.link.statistics.dropped) == (b"1" * SIZE + b"3" * SIZE, 1)


def test_a_queue_size_of_zero_keeps_every_message_up_to_the_limit_in_bytes() -> None:
    subscriber = Subscriber(0, Limits(queue_bytes=3 * SIZE))
    subscriber.send(*range(9))
    assert subscriber.link.statistics.dropped == 6
    subscriber.sock.space = 100
    assert subscriber.link.flush()
    assert subscriber.messages == "678"


def test_a_message_larger_than_the_limit_is_queued_nevertheless() -> None:
    subscriber = Subscriber(0, Limits(queue_bytes=1))
    subscriber.send(1)
    subscriber.sock.space = 100
    subscriber.link.flush()
    assert subscriber.messages == "1"


def test_without_a_queue_a_link_that_stays_full_has_stalled() -> None:
    subscriber = Subscriber(None)
    subscriber.send(1, 2, 3)
    assert subscriber.link.is_waited_for
    assert subscriber.link.statistics.dropped == 0
    subscriber.link.stop_waiting()
    assert not subscriber.link.is_waited_for
    assert subscriber.link.statistics.dropped == 2, "as with queue_size=1"


@pytest.mark.parametrize("is_left_before", [False, True])
def test_publish_waits_again_for_a_link_that_has_caught_up(drained: list[bool], is_left_before: bool) -> None:
    subscriber = Subscriber(None)
    subscriber.send(1)
    if is_left_before:
        subscriber.leave_to_loop()
    subscriber.link.stop_waiting()
    subscriber.leave_to_loop()
    subscriber.loop.fire(CHECK_STALLED_INTERVAL_S)
    assert not subscriber.link.is_waited_for, "it has not read anything yet"
    subscriber.allow(100)
    drained.clear()
    subscriber.loop.fire(CHECK_STALLED_INTERVAL_S)
    assert not subscriber.link.is_waited_for, "the system still holds the bytes"
    drained.append(True)
    subscriber.loop.fire(CHECK_STALLED_INTERVAL_S)
    assert subscriber.link.is_waited_for


@pytest.mark.parametrize("queue_size", [None, 0, 10])
def test_a_reset_ends_the_link_once(queue_size: int | None) -> None:
    subscriber = Subscriber(queue_size)
    subscriber.sock.is_reset = True
    subscriber.send(1, 2)
    subscriber.link.close()
    subscriber.loop.run()
    assert subscriber.ended == [subscriber.link]
    assert subscriber.sock.is_closed
    assert not subscriber.link.is_behind


def test_a_subscriber_that_closes_ends_the_link() -> None:
    subscriber = Subscriber(10)
    subscriber.sock.incoming = [b""]
    assert subscriber.loop.reader
    subscriber.loop.reader()
    subscriber.loop.run()
    assert (subscriber.ended, subscriber.link.end_reason) == ([subscriber.link], "")


def test_a_subscriber_that_sends_too_much_loses_the_link_with_a_reason(constants: Constants) -> None:
    constants(SUBSCRIBER_BYTES=10)
    subscriber = Subscriber(10, Limits())
    for data, is_closed in ((b"x" * 10, False), (b"x", True)):
        subscriber.sock.incoming = [data]
        assert subscriber.loop.reader
        subscriber.loop.reader()
        assert subscriber.link.is_closed is is_closed
    assert subscriber.link.end_reason == "it sent more than 10 bytes after its header"


def test_the_header_is_sent_first_and_is_not_counted() -> None:
    subscriber = Subscriber(10)
    subscriber.sock.space = 100
    subscriber.link.send_header(b"header")
    subscriber.send(1)
    assert (subscriber.sock.sent, subscriber.link.statistics.frames) == (b"header" + b"1" * SIZE, 1)


def test_queued_messages_do_not_change_when_the_publisher_reuses_its_message() -> None:
    subscriber = Subscriber(10)
    message = bytearray(b"1" * SIZE)
    subscriber.link.send((memoryview(message),), SIZE)
    message[:] = b"2" * SIZE
    subscriber.sock.space = 100
    subscriber.link.flush()
    assert subscriber.messages == "1"


def test_the_loop_turns_to_others_while_a_subscriber_reads_quickly() -> None:
    subscriber = Subscriber(0)
    subscriber.sock.most_at_once = TURN_BYTES // 4
    for _ in range(3):
        subscriber.link.send((bytes(TURN_BYTES),), TURN_BYTES)
    subscriber.leave_to_loop()
    subscriber.allow(3 * TURN_BYTES)
    assert len(subscriber.sock.sent) == TURN_BYTES
    assert subscriber.loop.writer


def test_a_closed_link_keeps_no_messages() -> None:
    subscriber = Subscriber(10)
    subscriber.send(1)
    subscriber.link.close()
    subscriber.send(2)
    subscriber.sock.space = 100
    assert not subscriber.link.flush()
    assert (subscriber.messages, subscriber.link.statistics.dropped) == ("", 1)


def test_a_stalled_link_that_falls_behind_again_is_left_to_the_loop(drained: list[bool]) -> None:
    subscriber = Subscriber(None)
    subscriber.send(1)
    subscriber.link.stop_waiting()
    subscriber.loop.run()
    drained.clear()
    subscriber.allow(SIZE)
    subscriber.send(2, 3)
    assert not subscriber.link.is_waited_for
    subscriber.loop.run()
    subscriber.allow(100)
    assert subscriber.messages == "13", "the newest waited only"
