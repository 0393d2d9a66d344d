"""Run a node's periodic work in separate threads, or in lockstep with a simulator.

A node is in lockstep if the parameter `/lockstep` lists its name; see "Lockstep" in the guide about
simulation. In this case, the simulator calls the service `~advance` between its steps. The call waits for
the callbacks of all messages sent to the node so far, and then runs all functions that are due, one after
the other, in the order in which they were added. Therefore, the node behaves identically in each run.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.throttle import Throttle
from pipros.msg import load_service_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros.node.delivery import Sent, sent_by, wait_until_handled
from pipros.node.rate import Timer, surviving
from pipros_libraries.transforms.messages import in_ns

CAPABLE: Final = "~in_lockstep"
"""Parameter of the nodes that will offer `~advance`, so that others are not waited for."""
MISSED_S: Final = 5.0
"""Interval between two warnings that a loop is too slow."""
_DELIVERY_S: Final = 10.0
"""Real time within which a sent message must arrive."""


@dataclass(slots=True)
class _Work:
    do: Callable[[], object]
    period_ns: int
    due_ns: int = 0


class Schedule:
    """Runs functions periodically. In lockstep, they run in the order in which `every` was called."""

    def __init__(self, node: Node, hold: Callable[[], bool] = lambda: False) -> None:
        """Read the parameter `/lockstep`.

        Args:
            hold: called at the end of `~advance`. While it returns True, simulated time stands still, and it
                is called again immediately, so it should wait briefly before returning True.
        """
        self._node, self._hold = node, hold
        self._work: list[_Work] = []
        self._slow = Throttle(node.log, MISSED_S)
        self._lock = threading.RLock()
        self.in_lockstep = node.name in _members(node)
        if self.in_lockstep:
            node.params.set(CAPABLE, True)
            self._service: Any = load_service_class("pipros_sim/Advance")

    def every(
        self,
        period_s: float,
        do: Callable[[], object],
        failed: Callable[[], object] | None = None,
        *,
        name: str = "",
    ) -> Callable[[float], None]:
        """Call `do` once per period on the node's clock. Return a function that changes the period.

        If `do` raises, `failed` is called, the error is logged once, and the next calls go on. In lockstep,
        missed calls are skipped. If the work has a name, a warning says if it is too slow for its period.
        """
        do = surviving(do, self._node.log, failed)
        work = _Work(do, round(period_s * 1e9))
        if self.in_lockstep:
            with self._lock:
                self._work.append(work)
            return lambda changed_s: setattr(work, "period_ns", round(changed_s * 1e9))
        timers: list[Timer] = []

        def start(changed_s: float) -> None:
            for timer in timers:
                timer.shutdown()
            period_ns = round(changed_s * 1e9)
            call = self._watched(name, period_ns, do) if name else do
            timers[:] = [Timer(self._node.clock, period_ns, lambda _: call(), reset=True, name="periodic")]

        start(period_s)
        return start

    def _watched(self, name: str, period_ns: int, do: Callable[[], object]) -> Callable[[], None]:
        """Return a function that calls `do`, and warns if it takes longer than the period, or is late."""
        text = f"{name} missed its desired rate of %.4fHz... the loop actually took %.4f seconds"
        begun_ns = 0

        def call() -> None:
            nonlocal begun_ns
            before_ns, begun_ns = begun_ns, self._node.clock.now_ns()
            do()
            taken_ns = self._node.clock.now_ns() - begun_ns
            if before_ns and begun_ns - before_ns > 2 * period_ns:  # a whole call was left out
                taken_ns = max(taken_ns, begun_ns - before_ns)
            if taken_ns > period_ns:
                self._slow.warning(text, 1e9 / period_ns, taken_ns / 1e9)

        return call

    def start(self) -> None:
        """If in lockstep, offer the service `~advance`. Create all subscriptions before this call."""
        if self.in_lockstep:
            self._node.serve("~advance", self._service, self._advance)

    def _advance(self, request: Any) -> Any:
        with self._lock:
            links = zip(request.topics, request.publishers, request.counts, strict=True)
            sent = [Sent(topic, publisher, self._node.name, count) for topic, publisher, count in links]
            for lost in wait_until_handled(self._node, sent, _DELIVERY_S):
                self._node.log.warning("messages of [%s] on [%s] did not arrive", lost.publisher, lost.topic)
            due_ns = self._run(in_ns(request.now))
        holds = self._hold()
        mine = sent_by(self._node)
        return self._service._response_class(
            holds,
            Time(*divmod(due_ns, 1_000_000_000)),
            [each.topic for each in mine],
            [each.subscriber for each in mine],
            [each.messages for each in mine],
        )

    def _run(self, now_ns: int) -> int:
        """Run the work that is due. Return the time at which work is next due, at most a second from now."""
        for work in self._work:
            work.due_ns = min(work.due_ns or now_ns + work.period_ns, now_ns + work.period_ns)
            if now_ns >= work.due_ns:
                work.due_ns = max(work.due_ns + work.period_ns, now_ns + 1)
                work.do()
        return min([now_ns + 1_000_000_000, *(work.due_ns for work in self._work)])


def _members(node: Node) -> list[str]:
    try:
        found = node.params.get("/lockstep")
    except LookupError:
        return []
    names = found if isinstance(found, list) else []
    return [f"/{each.lstrip('/')}" for each in names if isinstance(each, str)]
