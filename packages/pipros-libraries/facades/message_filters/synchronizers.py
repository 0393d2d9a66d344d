"""`TimeSynchronizer` and `ApproximateTimeSynchronizer`, which match messages by timestamp."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from threading import RLock
from typing import Any

import rospy
from message_filters.simple_filter import SimpleFilter, stamp_of
from pipros_libraries.filters.synchronizer import ApproximateSynchronizer, ExactSynchronizer, Queue


def _kept(name: str, doc: str) -> Any:
    """Return an attribute that the matcher keeps as `name`, and which subclasses may replace."""
    read = attrgetter(f"_matcher.{name}")
    return property(read, lambda filter_, value: setattr(filter_._matcher, name, value), doc=doc)


class TimeSynchronizer(SimpleFilter):
    """Filter that outputs sets of messages with equal timestamps, one message from each input.

    Callbacks run one at a time, in the thread that delivers the last message of a set. A callback may
    add messages. After an exception in a callback, later messages are still matched.

    Args:
        fs: the input filters.
        queue_size: maximum number of waiting messages for each input. If it is exceeded, the message with the
            oldest timestamp is dropped.
        reset: whether to clear the queues if simulated time jumps back.
    """

    def __init__(self, fs: Sequence[SimpleFilter], queue_size: int, reset: bool = False) -> None:
        super().__init__()
        self.lock = RLock()
        self._matcher: Any = self._new_matcher(len(fs), queue_size, reset)
        self.connectInput(fs)

    def _new_matcher(self, inputs: int, queue_size: int, reset: bool) -> ExactSynchronizer:
        return ExactSynchronizer(inputs, queue_size, reset, rospy.Time(0))

    queues: list[Queue] = _kept("queues", "The queue of each input: messages by timestamp in nanoseconds.")
    queue_size: int = _kept("queue_size", "Maximum number of waiting messages of each input.")
    enable_reset: bool = _kept("reset", "Whether the queues are cleared if simulated time jumps back.")
    latest_stamps: list[rospy.Time] = _kept(
        "times", "Simulated time at which the last message of each input arrived."
    )

    def connectInput(self, fs: Sequence[SimpleFilter]) -> None:
        """Connect new input filters. Waiting messages are dropped."""
        old = self._matcher
        self._matcher = self._new_matcher(len(fs), old.queue_size, old.reset)
        self.input_connections = [
            each.registerCallback(self.add, queue, index)
            for index, (each, queue) in enumerate(zip(fs, self._matcher.queues, strict=True))
        ]

    def add(self, msg: Any, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Add a message from the input with the given queue and index."""
        stamp: int = msg.header.stamp.to_nsec()
        with self.lock:
            now = self._simulated_now()
            for complete in self._matcher.add(msg, stamp, my_queue, my_queue_index, now):
                self.signalMessage(*complete)

    def _simulated_now(self) -> rospy.Time | None:
        """Return the simulated time, or None if `reset` is false or time is not simulated."""
        if not self._matcher.reset or rospy.rostime.is_wallclock():
            return None
        return rospy.Time.now()


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """Filter that outputs sets of messages, one from each input, whose timestamps differ by less than `slop`.

    Callbacks run as in `TimeSynchronizer`. If the clock, real or simulated, has jumped back since the
    previous message, all waiting messages and the new message are dropped.

    Args:
        fs: the input filters.
        queue_size: maximum number of waiting messages for each input. If it is exceeded, the message with the
            oldest timestamp is dropped.
        slop: exclusive limit on the difference between timestamps in a set, in seconds.
        allow_headerless: whether to use the time of arrival as the timestamp of messages without a header,
            instead of dropping them.
        reset: whether to clear an input's queue if simulated time has jumped back since its last message.
    """

    last_added: rospy.Time = _kept("newest_time", "When the last message arrived.")

    def __init__(
        self,
        fs: Sequence[SimpleFilter],
        queue_size: int,
        slop: float,
        allow_headerless: bool = False,
        reset: bool = False,
    ) -> None:
        self.slop = rospy.Duration.from_sec(slop)
        self.allow_headerless = allow_headerless
        super().__init__(fs, queue_size, reset)

    def _new_matcher(self, inputs: int, queue_size: int, reset: bool) -> ExactSynchronizer:
        return ApproximateSynchronizer(inputs, queue_size, self.slop.to_nsec(), reset, rospy.Time(0))

    def add(self, msg: Any, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Add a message from the input with the given queue and index."""
        stamp_as_time = stamp_of(msg, self.allow_headerless)
        if stamp_as_time is None:
            return
        stamp: int = stamp_as_time.to_nsec()
        with self.lock:
            matcher = self._matcher
            now = rospy.Time.now()
            simulated_now = now if matcher.reset and not rospy.rostime.is_wallclock() else None
            if matcher.went_back(now, simulated_now, my_queue_index):
                rospy.loginfo(
                    "Clock jumped back: dropped the messages that were waiting for synchronization."
                )
                return
            matcher.slop = self.slop.to_nsec()
            for complete in matcher.add(msg, stamp, my_queue, my_queue_index, simulated_now):
                self.signalMessage(*complete)
