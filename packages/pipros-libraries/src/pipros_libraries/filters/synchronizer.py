"""Match messages from several inputs by timestamp, with the same results as in Noetic.

Each input has a queue keyed by timestamp. A new message may complete a set (one message from each input),
which `add` removes from the queues and returns. If a queue is longer than `queue_size`, the messages with the
earliest timestamps are dropped.

If time is simulated and `reset` is true, a backward jump of the clock clears each queue when its input's next
message arrives. After such a jump, no set is completed as long as the last message of any input arrived at a
simulated time later than the current time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

Queue = dict[int, Any]
"""Messages by timestamp in nanoseconds, in order of arrival."""


class ExactSynchronizer:
    """Matches messages with equal timestamps."""

    def __init__(self, inputs: int, queue_size: int, reset: bool = False, start: Any = 0) -> None:
        """Store the arguments. `start` is the time 0, in the type of the times that are passed as now."""
        self.queues: list[Queue] = [{} for _ in range(inputs)]
        self.queue_size = queue_size
        self.reset = reset
        self.times = [start] * inputs  # simulated time when the last message from each input arrived

    def add(
        self, message: Any, stamp: int, queue: Queue, index: int | None, simulated_now: Any
    ) -> Iterable[Sequence[Any]]:
        """Add a message from the input that `queue` belongs to. Return the sets that are now complete.

        Args:
            index: the index of the input, if known.
            simulated_now: simulated time, or None if the clock is not simulated.
        """
        is_behind = self._is_behind(queue, simulated_now, index)
        queue[stamp] = message
        while len(queue) > self.queue_size:
            del queue[min(queue)]
        if is_behind:
            return ()
        if self.reset and simulated_now is not None:
            stamps = sorted(set.intersection(*map(set, self.queues)))
        else:  # only the new message can complete a set
            for other in self.queues:
                if stamp not in other:
                    return ()
            stamps = [stamp]
        return [[other.pop(complete) for other in self.queues] for complete in stamps]

    def _is_behind(self, queue: Queue, simulated_now: Any, index: int | None) -> bool:
        """Return whether an input last received a message at a later simulated time.

        If simulated time has jumped back since the last message of this input, its queue is cleared. If
        `index` is None, also return True if no input has received a message at the current simulated time.
        """
        if simulated_now is None or not self.reset:
            return False
        if index is not None:
            if simulated_now < self.times[index]:
                queue.clear()
            self.times[index] = simulated_now
        return bool(max(self.times) != simulated_now)


class ApproximateSynchronizer(ExactSynchronizer):
    """Matches messages whose timestamps differ by less than `slop` nanoseconds.

    If several messages from an input match, the message nearest in time to the new message is preferred.
    Earlier inputs take precedence.
    """

    def __init__(self, inputs: int, queue_size: int, slop: int, reset: bool = False, start: Any = 0) -> None:
        super().__init__(inputs, queue_size, reset, start)
        self.slop = slop
        self.newest_time = start

    def went_back(self, now: Any, simulated_now: Any, index: int | None) -> bool:
        """Return whether the clock, simulated or real, has jumped back since the last message.

        If so, all queues are cleared, and the caller must drop the new message, as in Noetic.
        """
        is_before, self.newest_time = now < self.newest_time, now
        if is_before:
            if simulated_now is not None and index is not None:
                self.times[index] = simulated_now
            for queue in self.queues:
                queue.clear()
        return bool(is_before)

    def add(
        self, message: Any, stamp: int, queue: Queue, index: int | None, simulated_now: Any
    ) -> Iterable[Sequence[Any]]:
        """Like the base class's method, but with approximately equal timestamps.

        If `index` is None, the set may contain another message from the same input instead of `message`.
        """
        is_behind = self._is_behind(queue, simulated_now, index)
        queue[stamp] = message
        while len(queue) > self.queue_size:
            del queue[min(queue)]
        if is_behind or (index is not None and stamp not in queue):
            return ()
        slop = self.slop
        low, high = stamp - slop, stamp + slop
        candidates: list[list[int]] = []
        for number, other in enumerate(self.queues):
            if number == index:
                candidates.append([stamp])
                continue
            near = [known for known in other if low <= known <= high]
            if not near:
                return ()
            if len(near) > 1:
                near.sort(key=lambda known: abs(known - stamp))
            candidates.append(near)
        found = _first_within(candidates, slop)
        if found is None:
            return ()
        return [[other.pop(chosen) for other, chosen in zip(self.queues, found, strict=True)]]


def _first_within(candidates: Sequence[Sequence[int]], slop: int) -> list[int] | None:
    """Return the first combination of one timestamp per input that spans less than `slop`, or None.

    Combinations are tried in lexicographic order of the candidates.
    """
    firsts = [each[0] for each in candidates]
    if max(firsts) - min(firsts) < slop:
        return firsts
    chosen: list[int] = []

    def extend(low: int, high: int) -> bool:
        if len(chosen) == len(candidates):
            return True
        for stamp in candidates[len(chosen)]:
            new_low, new_high = min(low, stamp), max(high, stamp)
            if new_high - new_low < slop:
                chosen.append(stamp)
                if extend(new_low, new_high):
                    return True
                chosen.pop()
        return False

    first, *rest = candidates
    if not rest:
        return None  # with a single input, every message matches unless the slop is 0
    for stamp in first:
        chosen.append(stamp)
        if extend(stamp, stamp):
            return chosen
        chosen.pop()
    return None
