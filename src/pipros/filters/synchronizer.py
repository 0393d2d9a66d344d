"""Messages of several inputs put together by their time stamps, in the order that Noetic has.

Each input has a queue by stamp. A message that arrives may complete a set, one message of each input, which
`add` returns and forgets. A queue that is longer than `queue_size` loses its oldest stamps.

Where the clock is simulated and `reset` is on, a clock that goes back empties the queues: each when its input
brings the next message, and sets are made only by inputs that are up to the newest time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

Queue = dict[int, Any]
"""Messages by their stamps in nanoseconds, in the order of their arrival."""


class ExactSynchronizer:
    """Sets of messages whose stamps are equal."""

    def __init__(self, inputs: int, queue_size: int, reset: bool = False) -> None:
        self.queues: list[Queue] = [{} for _ in range(inputs)]
        self.queue_size = queue_size
        self.reset = reset
        self._times = [0] * inputs  # of the clock, at the newest message of each input

    def add(
        self, message: Any, stamp: int, queue: Queue, index: int | None, simulated_now: int | None
    ) -> Iterable[Sequence[Any]]:
        """Takes a message of the input that has this queue, and returns the sets that are complete now.

        Args:
            index: which input it is, where that is known.
            simulated_now: the time of a simulated clock; None for a real one.
        """
        is_behind = self._is_behind(queue, simulated_now, index)
        queue[stamp] = message
        while len(queue) > self.queue_size:
            del queue[min(queue)]
        if is_behind:
            return ()
        if self.reset and simulated_now is not None:
            stamps = sorted(set.intersection(*map(set, self.queues)))
        else:  # earlier sets are gone: only this message can complete one
            for other in self.queues:
                if stamp not in other:
                    return ()
            stamps = [stamp]
        return [[other.pop(complete) for other in self.queues] for complete in stamps]

    def _is_behind(self, queue: Queue, simulated_now: int | None, index: int | None) -> bool:
        """Whether the input is older than another by a clock that may have gone back."""
        if simulated_now is None or not self.reset:
            return False
        if index is not None:
            if simulated_now < self._times[index]:
                queue.clear()
            self._times[index] = simulated_now
        return max(self._times) != simulated_now


class ApproximateSynchronizer(ExactSynchronizer):
    """Sets of messages whose stamps are less than `slop` nanoseconds apart.

    Of several messages of an input, the one nearest to that which arrived is taken; the first inputs choose
    first.
    """

    def __init__(self, inputs: int, queue_size: int, slop: int, reset: bool = False) -> None:
        super().__init__(inputs, queue_size, reset)
        self.slop = slop
        self._newest_time = 0

    def went_back(self, now: int, simulated_now: int | None, index: int | None) -> bool:
        """Whether the clock, simulated or not, went back since the last message.

        All queues are emptied then, and the new message is to be dropped, as in Noetic.
        """
        is_before, self._newest_time = now < self._newest_time, now
        if is_before:
            if simulated_now is not None and index is not None:
                self._times[index] = simulated_now
            for queue in self.queues:
                queue.clear()
        return is_before

    def add(
        self, message: Any, stamp: int, queue: Queue, index: int | None, simulated_now: int | None
    ) -> Iterable[Sequence[Any]]:
        """As in the base class. Without `index` the message's own queue is searched like all others."""
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
    """The first combination, one of each, that spans less than `slop`; the last candidates vary quickest."""
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
        return None  # even one message alone spans as much as the slop
    for stamp in first:
        chosen.append(stamp)
        if extend(stamp, stamp):
            return chosen
        chosen.pop()
    return None
