"""Dense runs of messages share packets."""

import threading
import time
from collections.abc import Callable
from typing import Any

from pipros.node.packet_sharing import (
    CHECK_S,
    CLOSE_S,
    LATE,
    RUN_LENGTH,
    SILENCE_S,
    BurstDetector,
    PacketSharing,
)

CLOSE, FAR = CLOSE_S / 2, CLOSE_S * 2


class Messages:
    """Send with a simulated clock; record the numbers of the messages that began or ended a dense run."""

    def __init__(self) -> None:
        self.pace = BurstDetector()
        self.now_s = 100.0
        self.sent = 0
        self.changes: list[int] = []

    def send(self, count: int, gap_s: float) -> None:
        for _ in range(count):
            self.now_s += gap_s
            self.sent += 1
            if self.pace.note(self.now_s):
                self.changes.append(self.sent)


def test_close_messages_make_a_dense_run() -> None:
    messages = Messages()
    messages.send(1 + RUN_LENGTH - 1, CLOSE)
    assert not messages.pace.in_burst
    messages.send(1000, CLOSE)
    assert messages.pace.in_burst
    assert messages.changes == [1 + RUN_LENGTH]


def test_separate_messages_do_not_make_a_burst() -> None:
    messages = Messages()
    messages.send(1000, FAR)
    assert not messages.pace.in_burst
    assert not messages.changes


def test_short_bursts_do_not_make_a_dense_run() -> None:
    messages = Messages()
    for _ in range(100):
        messages.send(LATE - 1, CLOSE)
        messages.send(1, FAR)
    assert not messages.changes


def test_a_late_message_does_not_end_a_run_but_a_few_in_a_row_do() -> None:
    messages = Messages()
    messages.send(1 + RUN_LENGTH, CLOSE)
    for _ in range(10):
        messages.send(1, FAR)
        messages.send(LATE, CLOSE)
    assert messages.pace.in_burst
    messages.send(RUN_LENGTH // LATE - 1, FAR)
    assert messages.pace.in_burst
    messages.send(1, FAR)
    assert not messages.pace.in_burst
    assert len(messages.changes) == 2


def test_silence_ends_a_run_once() -> None:
    messages = Messages()
    messages.send(1 + RUN_LENGTH, CLOSE)
    assert not messages.pace.end_if_idle(messages.now_s + SILENCE_S / 2)
    assert messages.pace.end_if_idle(messages.now_s + SILENCE_S)
    assert not messages.pace.in_burst
    assert not messages.pace.end_if_idle(messages.now_s + SILENCE_S)
    messages.send(RUN_LENGTH, CLOSE)
    assert messages.pace.in_burst, "the next run starts over"


class Link:
    """Record whether packets are shared."""

    def __init__(self) -> None:
        self.changes: list[bool] = []

    def share_packets(self, *, share: bool) -> None:
        self.changes.append(share)


class Loop:
    """Record delayed calls with their delays."""

    def __init__(self) -> None:
        self.later: list[tuple[float, Callable[[], None]]] = []
        self.asyncio = self

    def call(self, function: Callable[[], None]) -> None:
        self.call_later(0, function)

    def call_later(self, delay_s: float, function: Callable[[], None]) -> None:
        self.later.append((delay_s, function))

    def turn(self) -> float:
        """Run the next delayed call; return its delay."""
        delay_s, function = self.later.pop(0)
        function()
        return delay_s


class Topic:
    """Packet sharing of one topic with two links."""

    def __init__(self) -> None:
        self.loop = Loop()
        self.links = [Link(), Link()]
        self.lock = threading.Lock()
        loop: Any = self.loop
        self.flushes: list[bool] = []
        self.sharing = PacketSharing(
            loop, self.lock, lambda: self.links, lambda: self.flushes.append(self.lock.locked())
        )
        self.now_s = time.monotonic()

    def send(self, count: int, gap_s: float) -> None:
        for _ in range(count):
            self.now_s += gap_s
            if self.sharing.note(self.now_s):
                self.sharing.apply()


def test_all_links_share_packets_in_a_burst_and_new_ones_too() -> None:
    topic = Topic()
    topic.sharing.apply_to(topic.links[0])
    topic.send(1 + RUN_LENGTH, CLOSE)
    assert [link.changes for link in topic.links] == [[False, True], [True]]
    topic.links.append(Link())
    topic.sharing.apply_to(topic.links[2])
    topic.send(RUN_LENGTH, FAR)
    assert [link.changes[-2:] for link in topic.links] == [[True, False]] * 3


def test_a_burst_is_watched_until_it_has_ended_in_silence() -> None:
    topic = Topic()
    topic.now_s += 3600  # so that the burst still lasts by the watch's clock
    topic.send(1 + RUN_LENGTH, CLOSE)
    assert (topic.loop.turn(), topic.loop.turn()) == (0, CHECK_S)
    assert topic.flushes == [True, True], "with the lock held"
    assert topic.links[0].changes == [True]
    quiet = Topic()
    quiet.now_s -= 3600
    quiet.send(1 + RUN_LENGTH, CLOSE)
    quiet.loop.turn()
    assert (quiet.links[0].changes, quiet.loop.later) == ([True, False], [])
    quiet.send(1 + RUN_LENGTH, CLOSE)
    assert len(quiet.loop.later) == 1, "the next burst is watched, too"


def test_the_watch_ends_with_the_topic() -> None:
    topic = Topic()
    topic.now_s += 3600
    topic.send(1 + RUN_LENGTH, CLOSE)
    topic.sharing.close()
    topic.loop.turn()
    assert topic.loop.later == []


def test_the_watch_does_not_wait_for_a_message_that_is_being_published() -> None:
    topic = Topic()
    topic.now_s -= 3600
    topic.send(1 + RUN_LENGTH, CLOSE)
    with topic.lock:
        topic.loop.turn()
        assert topic.loop.turn() == CHECK_S
    assert topic.links[0].changes == [True]
    topic.loop.turn()
    assert (topic.links[0].changes, topic.loop.later) == ([True, False], [])
