"""Small messages of a burst are sent together, in order, and never kept for long."""

import gc
import threading
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.net.busy_poll import PublishCount
from pipros.net.outgoing_state import LinkState
from pipros.node import message_batch, publication
from pipros.node.message_batch import MAX_AGE_S, MAX_MESSAGES
from pipros.node.packet_sharing import CLOSE_S, PACKET_SHARING_BYTES, RUN_LENGTH
from pipros.node.publication import Publication
from pipros.node.timings import NODE_TIMINGS

UInt32: Any = load_message_class("std_msgs/UInt32")


ByteArray: Any = load_message_class("std_msgs/UInt8MultiArray")


CLOSE = MAX_AGE_S / (2 * MAX_MESSAGES)


class Link:
    """Records the number of messages in each call."""

    state = LinkState.IDLE
    is_behind = False

    def __init__(self) -> None:
        self.calls: list[int] = []
        self.sent = b""

    def send(self, message: Any, _: int) -> None:
        self.calls.append(1)
        self.sent += b"".join(message)

    def send_together(self, messages: Any, joined: bytes) -> None:
        self.calls.append(len(messages))
        assert b"".join(messages) == joined
        self.sent += joined

    def share_packets(self, *, share: bool) -> None: ...

    def close(self) -> None: ...


class Topic:
    """A publication on a simulated clock, in a burst after `begin_burst`."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, queue_size: int | None = 10) -> None:
        self.now_s = 100.0
        monkeypatch.setattr(publication, "time", SimpleNamespace(monotonic=lambda: self.now_s))
        self.received = PublishCount()
        context: Any = SimpleNamespace(
            limits=SimpleNamespace(stall_s=2.0), timings=NODE_TIMINGS,
            loop=SimpleNamespace(call=lambda _: None), published=PublishCount(), received=self.received,
        )  # fmt: skip
        self.publication = Publication("t", UInt32, context)
        self.publication.queue_size = queue_size
        self.link = Link()
        self.publication.links = (SimpleNamespace(link=self.link),)
        self.count = 0

    def publish(self, count: int = 1, gap_s: float = CLOSE) -> None:
        for _ in range(count):
            self.now_s += gap_s
            self.publication.publish(UInt32(self.count))
            self.count += 1

    def begin_burst(self) -> None:
        self.publish(1 + RUN_LENGTH)
        self.publication.flush()
        self.link.calls.clear()

    @property
    def numbers(self) -> list[int]:
        """The published numbers that were sent."""
        sent = self.link.sent
        return [int.from_bytes(sent[at + 4 : at + 8], "little") for at in range(0, len(sent), 8)]


@pytest.fixture
def topic(monkeypatch: pytest.MonkeyPatch) -> Topic:
    """A topic in a burst."""
    made = Topic(monkeypatch)
    made.begin_burst()
    return made


def test_messages_of_a_burst_are_sent_together_in_order(topic: Topic) -> None:
    topic.publish(3 * MAX_MESSAGES)
    assert (topic.link.calls, topic.numbers) == ([MAX_MESSAGES] * 3, list(range(topic.count)))


def test_separate_messages_are_sent_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    topic = Topic(monkeypatch)
    topic.publish(100, gap_s=2 * CLOSE_S)
    assert topic.link.calls == [1] * 100


def test_a_message_that_waited_is_sent_with_the_next_after_its_time(topic: Topic) -> None:
    topic.publish(2)
    topic.publish(1, gap_s=MAX_AGE_S)
    assert topic.link.calls == [3]


def test_after_a_pause_a_message_is_sent_at_once(topic: Topic) -> None:
    topic.publish(2)
    topic.publish(1, gap_s=CLOSE_S)
    assert (topic.link.calls, topic.numbers) == ([2, 1], list(range(topic.count)))


def test_a_reply_is_sent_at_once(topic: Topic) -> None:
    for _ in range(5):
        topic.received.value += 1
        topic.publish()
    assert topic.link.calls == [1] * 5


def test_without_a_queue_each_message_is_sent_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    topic = Topic(monkeypatch, queue_size=None)
    topic.begin_burst()
    topic.publish(20)
    assert topic.link.calls == [1] * 20


def test_without_a_queue_bursts_are_noticed_only_for_links_that_share_packets(monkeypatch) -> None:
    topic = Topic(monkeypatch, queue_size=None)
    topic.begin_burst()
    assert not topic.publication._burst.in_burst
    topic.publication._may_share_packets = True
    topic.begin_burst()
    assert topic.publication._burst.in_burst


def test_messages_of_a_queue_are_sent_before_those_without_one(topic: Topic) -> None:
    topic.publish(3)
    topic.publication.queue_size = None
    topic.publish()
    assert (topic.link.calls, topic.numbers) == ([3, 1], list(range(topic.count)))


def test_a_large_message_does_not_overtake_small_ones(topic: Topic) -> None:
    topic.publish(2)
    topic.publication.encoder._encode = lambda _: [bytes(PACKET_SHARING_BYTES + 1)]
    topic.publish()
    assert topic.link.calls == [2, 1]


def test_the_loop_sends_what_is_left(topic: Topic) -> None:
    topic.publish(3)
    with topic.publication._lock:
        topic.publication._leave_batch_to_loop()
    assert topic.link.calls == [3]


def test_collected_messages_are_sent_before_the_process_forks_or_ends(topic: Topic) -> None:
    topic.publish(3)
    message_batch._flush_all()
    assert topic.link.calls == [3]
    topic.publish(2)
    topic.publication.close()
    assert topic.link.calls == [3, 2]


def test_a_fork_does_not_wait_for_a_message_that_is_being_published(topic: Topic) -> None:
    topic.publish(3)
    flushing = threading.Thread(target=message_batch._flush_all)
    with topic.publication._lock:
        flushing.start()
        flushing.join(60)
        assert not flushing.is_alive()
    assert topic.link.calls == []


def test_topics_that_are_gone_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    topic = Topic(monkeypatch)
    topic.begin_burst()
    known = len(message_batch._topics)
    del topic
    monkeypatch.undo()
    gc.collect()
    assert len(message_batch._topics) < known


# Sequence numbers in the headers of published messages.


PointStamped: Any = load_message_class("geometry_msgs/PointStamped")


def test_sequence_numbers_wrap_around() -> None:
    sent: list[int] = []
    context: Any = SimpleNamespace(
        limits=SimpleNamespace(stall_s=2.0), loop=None, published=PublishCount(), received=PublishCount()
    )
    publication = Publication("p", PointStamped, context)
    peer: Any = SimpleNamespace(link=SimpleNamespace(send=lambda frame, size: None, state=LinkState.IDLE))
    publication.links = (peer,)
    publication.encoder.sequence = 2**32 - 3
    for _ in range(4):
        message = PointStamped()
        publication.publish(message)
        sent.append(message.header.seq)
    assert sent == [2**32 - 2, 2**32 - 1, 0, 1]
