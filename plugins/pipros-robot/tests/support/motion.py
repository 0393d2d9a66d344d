"""What a base would receive from each program that commands velocities, while faults happen.

A program runs in this process, as its `main` does, with a node without links and a clock that a `Rig` steps.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import logging
import math
import sys
from collections.abc import Callable, Iterator
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any, Final

import pytest

from pipros.basics.env import Environment
from pipros.node import rate
from pipros.node.rate import Rate, Tick
from pipros_libraries.nodes.velocities import VELOCITIES, speeds
from tests.support.unlinked_node import UnlinkedNode

STEP_S: Final = 0.01
BEGIN_NS: Final = 10_000_000_000_000
LOG: Final = logging.getLogger("motion")


class SteppedTimer:
    """A `Timer` without a thread: its rig calls it."""

    rig: Rig

    def __init__(self, clock: Any, period_ns: int, callback: Callable[[Tick], object], **_: Any) -> None:
        self._rate, self._callback = Rate(clock, period_ns, reset=True), callback
        self._is_busy = self._is_over = False
        self.rig.timers.append(self)

    def shutdown(self) -> None:
        self._is_over = True

    def step(self) -> None:
        """Call the function if it is due, and not at work already."""
        while not (self._is_over or self._is_busy or self._rate.remaining_ns() > 0):
            self._rate.sleep()
            self._is_busy = True
            try:
                self._callback(Tick(None, None, 0, 0, None))
            finally:
                self._is_busy = False


class RigNode(UnlinkedNode):
    """A node of a rig, which records its velocities. Waits let the rig's time pass."""

    rig: Rig

    def advertise(self, topic: str, message_class: Any, **options: Any) -> Any:
        made = super().advertise(topic, message_class, **options)
        if message_class._type in VELOCITIES:
            publish = made.publish

            def note(message: Any) -> None:
                self.rig.note(message)
                publish(message)

            made.publish = note
        return made

    def subscribe(self, topic: str, message_class: Any, callback: Any, **options: Any) -> Any:  # type: ignore[override]
        super().subscribe(topic, message_class, callback, **options)
        self.rig.subscribed(self.resolve(topic), callback)
        return Source(self.rig)

    def wait_for_shutdown(self, timeout_s: float | None = None) -> bool:
        return self.rig.run(math.inf if timeout_s is None else timeout_s)


class Source:
    """A subscriber, whose publishers have ended if the rig says so."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    @property
    def connection_count(self) -> int:
        return int(not self._rig.is_abandoned)

    def unregister(self) -> None:
        pass


class Rig:
    """Time, events and the base of one run.

    Attributes:
        now_s: the time since the beginning.
        jump_s: how far the system's clock has jumped.
        is_abandoned: whether the publishers of all sources have ended.
        sent: the times and values of all velocities.
        shown: what the program gave to its page.
        pressed: the keys that are about to be read.
        world: what surrounds the robot, if its program needs it.
    """

    def __init__(self, patch: pytest.MonkeyPatch, master_uri: str, end_s: float) -> None:
        self.now_s = self.jump_s = 0.0
        self.is_abandoned = False
        self.timers: list[SteppedTimer] = []
        self.sent: list[tuple[float, tuple[float, ...]]] = []
        self.shown: Any = None
        self.world: Any = None
        self.pressed: list[str] = []
        self.subscribed: Callable[[str, Any], object] = lambda topic, callback: None
        self._agenda: list[tuple[float, int, Callable[[], object]]] = []
        self._order = itertools.count()
        self._end_s, self._uri = end_s, master_uri
        patch.setattr("time.time_ns", lambda: BEGIN_NS + round((self.now_s + self.jump_s) * 1e9))
        made: Any = type("Timer", (SteppedTimer,), {"rig": self})
        for module in [each for each in sys.modules.values() if vars(each).get("Timer") is rate.Timer]:
            patch.setattr(module, "Timer", made)
        self.patch = patch
        self.node = type("Node", (RigNode,), {"rig": self})(
            "tested", environment=Environment(master_uri=master_uri)
        )

    def prepare(self) -> None:
        """Called when the node has started, before its program."""

    def runs(self, module: ModuleType) -> None:
        """Let the functions with which a module starts nodes, serves pages and waits use this rig."""

        @contextlib.contextmanager
        def program(*_: Any, **__: Any) -> Iterator[Any]:
            try:  # `Program.begin` has started the node
                yield self.node, LOG
            finally:
                self.node.shutdown()

        def keep(*arguments: Any, **named: Any) -> Any:
            self.shown = SimpleNamespace(move=arguments[3], buttons=arguments[4], **named)
            return SimpleNamespace(served_views=lambda: None)

        replacements = {
            "roscpp_program": program, "served_page": lambda *_: contextlib.nullcontext(),
            "single_keys": lambda **_: contextlib.nullcontext(), "pressed_keys": lambda node: self._keys(),
            "SliderPage": keep, "time": SimpleNamespace(monotonic=lambda: self.now_s),
            "Steering": partial(getattr(module, "Steering", object), clock_s=lambda: self.now_s),
        }  # fmt: skip
        for name, replacement in replacements.items():
            if hasattr(module, name):
                self.patch.setattr(module, name, replacement)

    def _keys(self) -> Iterator[str]:
        while not self.run(0.05):
            yield self.pressed.pop() if self.pressed else ""

    def at(self, when_s: float, do: Callable[[], object]) -> None:
        """Do something at a time."""
        heapq.heappush(self._agenda, (when_s, next(self._order), do))

    def every(self, period_s: float, do: Callable[[], object], begin_s: float = 0.0) -> None:
        """Do something periodically."""

        def again() -> None:
            self.every(period_s, do, begin_s + period_s)
            do()

        self.at(begin_s, again)

    def give(self, topic: str, message: Any) -> None:
        """Give a message to the node, if it subscribes to the topic."""
        for callback in self.node.inputs.get(topic, []):
            callback(message)

    def note(self, message: Any) -> None:
        self.sent.append((self.now_s, tuple(speeds(message))))

    def close(self) -> None:
        self.node.shutdown()

    def run(self, duration_s: float) -> bool:
        """Let time pass. Return whether the node has ended, which it does at the end of the run."""
        until_s = self.now_s + duration_s
        while self.now_s < min(until_s, self._end_s) and not self.node.is_ending:
            self.now_s = round(self.now_s + STEP_S, 6)
            while self._agenda and self._agenda[0][0] <= self.now_s:
                heapq.heappop(self._agenda)[2]()
            for timer in self.timers:
                timer.step()
        if self.now_s >= self._end_s:
            self.node.shutdown("the end of the run")
        is_ending: bool = self.node.is_ending
        return is_ending

    # -- what the base has received ----------------------------------------------

    def last(self, at_s: float = math.inf) -> float:
        """Return the greatest number of the last velocity until a time."""
        return size(next((values for when_s, values in reversed(self.sent) if when_s <= at_s), (0.0,)))

    def gap(self, begin_s: float, end_s: float) -> float:
        """Return the longest time without a message after a velocity that was not zero."""
        times = [(when_s, size(values) > 0) for when_s, values in self.sent if begin_s <= when_s <= end_s]
        pairs = itertools.pairwise([*times, (end_s, False)])
        return max((after - before for (before, is_moving), (after, _) in pairs if is_moving), default=0.0)

    def greatest(self) -> float:
        return max((size(values) for _, values in self.sent), default=0.0)

    def stopped_s(self) -> float:
        """Return when the base was stopped for good before the end; infinity if it was not."""
        before = [each for each in self.sent if each[0] < self._end_s]
        moving = [index for index, (_, values) in enumerate(before) if size(values) > 0]
        if not moving:
            return 0.0
        return before[moving[-1] + 1][0] if moving[-1] + 1 < len(before) else math.inf


def size(values: tuple[float, ...]) -> float:
    """Return the greatest magnitude; infinity if a number is not finite."""
    return max(map(abs, values), default=0.0) if all(map(math.isfinite, values)) else math.inf
