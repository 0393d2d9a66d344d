"""Polling a socket briefly before a blocking read."""

import socket
import threading
import time
from collections.abc import Iterator

import pytest

from pipros.net.busy_poll import STREAM_POLL_S, PollingReceiver


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
