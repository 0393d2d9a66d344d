"""Messages of several filters, put together by their stamps."""

from __future__ import annotations

from collections.abc import Sequence
from threading import RLock
from typing import Any

import rospy
from message_filters.simple_filter import SimpleFilter, stamp_of
from pipros.filters.synchronizer import ApproximateSynchronizer, ExactSynchronizer, Queue


class TimeSynchronizer(SimpleFilter):
    """Calls back with one message of each filter when their stamps are equal.

    Calls come one at a time. A callback may raise, and may feed the filters: neither stops later sets.

    Args:
        fs: the filters.
        queue_size: how many messages of each filter wait for the others; the oldest stamps are dropped.
        reset: forget what waits when a simulated clock goes back.
    """

    def __init__(self, fs: Sequence[SimpleFilter], queue_size: int, reset: bool = False) -> None:
        super().__init__()
        self.lock = RLock()
        self._matcher: Any = self._new_matcher(len(fs), queue_size, reset)
        self.connectInput(fs)

    def _new_matcher(self, inputs: int, queue_size: int, reset: bool) -> ExactSynchronizer:
        return ExactSynchronizer(inputs, queue_size, reset)

    @property
    def queues(self) -> list[Queue]:
        """What waits of each filter: messages by their stamps in nanoseconds."""
        queues: list[Queue] = self._matcher.queues
        return queues

    @property
    def queue_size(self) -> int:
        """How many messages of each filter wait at most."""
        return int(self._matcher.queue_size)

    @queue_size.setter
    def queue_size(self, value: int) -> None:
        self._matcher.queue_size = value

    @property
    def enable_reset(self) -> bool:
        """Whether a simulated clock that goes back empties the queues."""
        return bool(self._matcher.reset)

    @enable_reset.setter
    def enable_reset(self, value: bool) -> None:
        self._matcher.reset = value

    def connectInput(self, fs: Sequence[SimpleFilter]) -> None:
        """Takes the messages of these filters; what waits of others is forgotten."""
        old = self._matcher
        self._matcher = self._new_matcher(len(fs), old.queue_size, old.reset)
        self.input_connections = [
            each.registerCallback(self.add, queue, index)
            for index, (each, queue) in enumerate(zip(fs, self._matcher.queues, strict=True))
        ]

    def add(self, msg: Any, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Takes a message of the filter that has this queue and number."""
        stamp: int = msg.header.stamp.to_nsec()
        with self.lock:
            now = self._simulated_now()
            for complete in self._matcher.add(msg, stamp, my_queue, my_queue_index, now):
                self.signalMessage(*complete)

    def _simulated_now(self) -> int | None:
        """The time of a simulated clock, where it matters."""
        if not self._matcher.reset or rospy.rostime.is_wallclock():
            return None
        return rospy.Time.now().to_nsec()


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """Calls back with one message of each filter when their stamps are less than `slop` apart.

    Calls come one at a time. A callback may raise, and may feed the filters: neither stops later sets. When
    the clock goes back, what waits is forgotten.

    Args:
        fs: the filters.
        queue_size: how many messages of each filter wait for the others; the oldest stamps are dropped.
        slop: seconds.
        allow_headerless: take messages without header by the time of their arrival; otherwise they are
        dropped. reset: forget what waits of a filter when a simulated clock goes back.
    """

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
        return ApproximateSynchronizer(inputs, queue_size, self.slop.to_nsec(), reset)

    def add(self, msg: Any, my_queue: Queue, my_queue_index: int | None = None) -> None:
        """Takes a message of the filter that has this queue and number."""
        stamp_as_time = stamp_of(msg, self.allow_headerless)
        if stamp_as_time is None:
            return
        stamp: int = stamp_as_time.to_nsec()
        with self.lock:
            matcher = self._matcher
            now: int = rospy.Time.now().to_nsec()
            simulated_now = now if matcher.reset and not rospy.rostime.is_wallclock() else None
            if matcher.went_back(now, simulated_now, my_queue_index):
                rospy.loginfo("The clock went back: messages that waited to be synchronized are dropped.")
                return
            matcher.slop = self.slop.to_nsec()
            for complete in matcher.add(msg, stamp, my_queue, my_queue_index, simulated_now):
                self.signalMessage(*complete)
