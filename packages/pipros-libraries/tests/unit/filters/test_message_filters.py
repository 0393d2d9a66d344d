"""The facade message_filters, without a node."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest
from std_msgs.msg import Header, String

import message_filters
import rospy


class Stamped:
    def __init__(self, stamp: int) -> None:
        self.header = Header(stamp=rospy.Time(stamp))

    def __repr__(self) -> str:
        return f"at {self.header.stamp.secs}"


@pytest.fixture(autouse=True)
def time() -> Iterator[None]:
    rospy.rostime.set_rostime_initialized(True)
    yield
    rospy.rostime.switch_to_wallclock()
    rospy.rostime.set_rostime_initialized(False)


def inputs_of(kind: str) -> tuple[list[message_filters.SimpleFilter], Any]:
    inputs = [message_filters.SimpleFilter() for _ in range(2)]
    if kind == "exact":
        return inputs, message_filters.TimeSynchronizer(inputs, 5)
    return inputs, message_filters.ApproximateTimeSynchronizer(inputs, 5, 0.5)


@pytest.mark.parametrize("kind", ["exact", "approximate"])
def test_callbacks_may_raise_and_add_messages(kind: str) -> None:
    inputs, synchronizer = inputs_of(kind)
    sets = []

    def feed_and_raise(first: Stamped, second: Stamped, more: str) -> None:
        sets.append((first.header.stamp.secs, second.header.stamp.secs, more))
        if len(sets) == 1:
            for each in inputs:
                each.signalMessage(Stamped(2))
            raise ValueError("by the callback")

    synchronizer.registerCallback(feed_and_raise, "more")
    inputs[0].signalMessage(Stamped(1))
    with pytest.raises(ValueError, match="by the callback"):
        inputs[1].signalMessage(Stamped(1))
    for each in inputs:
        each.signalMessage(Stamped(3))

    assert sets == [(1, 1, "more"), (2, 2, "more"), (3, 3, "more")]


def test_inputs_may_come_in_threads() -> None:
    inputs, synchronizer = inputs_of("exact")
    synchronizer.queue_size = 1000
    sets: list[int] = []
    synchronizer.registerCallback(lambda first, second: sets.append(first.header.stamp.secs))

    def feed(each: message_filters.SimpleFilter) -> None:
        for stamp in range(1, 301):
            each.signalMessage(Stamped(stamp))

    threads = [threading.Thread(target=feed, args=(each,)) for each in inputs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    assert sets == list(range(1, 301))


def test_messages_without_header_are_dropped_or_take_the_time() -> None:
    inputs = [message_filters.SimpleFilter() for _ in range(2)]
    sets: list[Any] = []
    for allowed in (False, True):
        made = message_filters.ApproximateTimeSynchronizer(inputs, 5, 10.0, allow_headerless=allowed)
        made.registerCallback(lambda *got: sets.append([message.data for message in got]))
    for each in inputs:
        each.signalMessage(String("x"))

    assert sets == [["x", "x"]]


def test_a_chain_feeds_its_filters_in_order() -> None:
    source = message_filters.SimpleFilter()
    chain = message_filters.Chain(source)
    got: list[Any] = []
    chain.registerCallback(got.append)
    second: Any = message_filters.PassThrough()
    assert chain.addFilter(message_filters.PassThrough()) == 0
    assert chain.addFilter(second) == 1
    source.signalMessage("message")

    assert got == ["message"]
    assert chain.getFilter(1) is second
    assert chain.getFilter(2) is None


def test_a_sequencer_puts_messages_in_order() -> None:
    rospy.rostime._set_rostime(rospy.Time(100))
    source = message_filters.SimpleFilter()
    sequencer = message_filters.TimeSequencer(source, rospy.Duration(5), rospy.Duration(3600), 10)
    got: list[Any] = []
    sequencer.registerCallback(lambda message: got.append(message.header.stamp.secs))
    for stamp in (95, 93, 99, 94):
        source.signalMessage(Stamped(stamp))
    sequencer.dispatch()
    sequencer.shutdown()

    assert got == [93, 94, 95]
