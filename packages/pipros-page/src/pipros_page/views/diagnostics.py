"""Status of each component with values and history, as in `rqt_robot_monitor`."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import threading
from collections import deque
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from pipros.node.any_msg import AnyMsg
from pipros_page.bounded_list import PAGE_VIEW_BYTES
from pipros_page.messages.known_topic import LONGEST_NAME, KnownTopic
from pipros_page.stale import REPORT_S
from pipros_page.watched_system import WatchedSystem
from pipros_tools.graph.observer import GraphObservation

TOPICS = ("/diagnostics_agg", "/diagnostics")
SEND_INTERVAL_S = 0.5
STALE_LEVEL = 3
MAX_COMPONENTS = 3000
MAX_VALUES = 200
HISTORY = 60
HISTORY_BYTES = HISTORY * 150
LONGEST_TEXT = 1000
MAX_SENT_BYTES = 1_000_000
"""Approximate maximum size of one update. The rest is sent in the next update."""


@dataclass(frozen=True, slots=True)
class DiagnosticItem:
    """The newest status of a component.

    Attributes:
        number: sequence number, in the order of arrival.
        level: 0 OK, 1 warning, 2 error, 3 stale.
        size: approximate size in bytes.
        history: the newest levels, with the wall times (s) of their arrival.
    """

    number: int
    level: int
    message: str
    hardware: str
    values: Sequence[Sequence[str]]
    size: int
    last_s: float
    history: deque[tuple[float, int]]


class Statuses:
    """The status of each component that has reported. Messages are added by the threads that receive them."""

    def __init__(self, max_bytes: int) -> None:
        """Create a table of at most `max_bytes`. When it is full, new statuses are stored without values."""
        self._max_bytes = max_bytes
        self._bytes = 0
        self._count = 0
        self._statuses: dict[str, DiagnosticItem] = {}
        self._lock = threading.Lock()

    def add(self, message: Any, _: AnyMsg | None, wall_s: float) -> None:
        """Add a `diagnostic_msgs/DiagnosticArray`. Long strings are shortened."""
        with self._lock:
            for status in message.status:
                name = status.name[:LONGEST_NAME]
                if name in self._statuses or len(self._statuses) < MAX_COMPONENTS:
                    self._add(name, status, wall_s)

    def _add(self, name: str, status: Any, wall_s: float) -> None:
        known = self._statuses.get(name)
        history = known.history if known else deque(maxlen=HISTORY)
        level = status.level if isinstance(status.level, int) else ord(status.level)
        history.append((round(wall_s, 1), level))
        message, hardware = status.message[:LONGEST_TEXT], status.hardware_id[:LONGEST_NAME]
        values = [[pair.key[:LONGEST_NAME], pair.value[:LONGEST_TEXT]] for pair in status.values[:MAX_VALUES]]
        of_texts = sum(map(sys.getsizeof, (name, message, hardware))) + HISTORY_BYTES
        of_values = sum(sys.getsizeof(pair) + sum(map(sys.getsizeof, pair)) for pair in values)
        self._bytes -= known.size if known else 0
        if self._bytes + of_texts + of_values > self._max_bytes:
            values, of_values = [["…", f"omitted; the limit is {self._max_bytes} bytes"]], 0
        size = of_texts + of_values
        self._bytes += size
        self._count += 1
        self._statuses[name] = DiagnosticItem(
            self._count, level, message, hardware, values, size, wall_s, history
        )

    def levels(self, now_s: float) -> Mapping[str, tuple[int, float, str]]:
        """Return the level (`STALE_LEVEL` without recent reports), age (s) and message of each component."""
        with self._lock:
            found = {name: (now_s - each.last_s, each) for name, each in self._statuses.items()}
        return {
            name: (STALE_LEVEL if age_s > REPORT_S else each.level, age_s, each.message)
            for name, (age_s, each) in found.items()
        }

    def news(self, sent: dict[str, int], max_bytes: int) -> list[Mapping[str, Any]]:
        """Return the statuses that have changed since a view sent them, up to about `max_bytes`.

        Statuses that the view has never sent come first, followed by the statuses that it sent longest ago.

        Args:
            sent: numbers of the statuses that the view has sent, by component. Updated in place.
        """
        rows: list[Mapping[str, Any]] = []
        with self._lock:
            found = self._statuses.items()
            waiting = [
                (sent.get(name, 0), name) for name, status in found if status.number > sent.get(name, 0)
            ]
            for _, name in sorted(waiting):
                if max_bytes <= 0:
                    break
                status = self._statuses[name]
                sent[name] = status.number
                max_bytes -= status.size
                rows.append(
                    {
                        "name": name,
                        "level": status.level,
                        "message": status.message,
                        "hardware": status.hardware,
                        "values": status.values,
                        "last": status.last_s,
                        "history": list(status.history),
                    }
                )
        return rows


class DiagnosticViews:
    """The view of the Diagnostics tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system
        self._shared = {name: system.shared(open_statuses, name) for name in TOPICS}

    async def diagnostics(self, _: Mapping[str, object]) -> AsyncIterator[object]:
        """Yield the list of all components, then periodically the list of changed components.

        If an aggregator exists, yield only its statuses.
        """
        observations = self._system.observations()
        observation = await anext(observations)
        names = topics_of(observation)
        with ExitStack() as stack:
            opened = [stack.enter_context(self._shared[name].use()) for name in names]
            sent: list[dict[str, int]] = [{} for _ in opened]
            while True:
                is_fresh = not any(sent)
                components = [
                    row
                    for (statuses, _), before in zip(opened, sent, strict=True)
                    for row in statuses.news(before, MAX_SENT_BYTES)
                ]
                yield {
                    "components": components,
                    "fresh": is_fresh,
                    "topics": names,
                    "now": self._system.now_s(),
                    "stale": REPORT_S,
                    "error": "\n".join(filter(None, (topic.problem for _statuses, topic in opened))),
                }
                await asyncio.sleep(SEND_INTERVAL_S)


def topics_of(observation: GraphObservation) -> Sequence[str]:
    """Return the topics whose statuses are shown: the first published one of `TOPICS`, or else both."""
    return [name for name in TOPICS if name in observation.state.publishers][:1] or list(TOPICS)


@contextlib.contextmanager
def open_statuses(system: WatchedSystem, name: str) -> Iterator[tuple[Statuses, KnownTopic]]:
    """Provide the statuses on a topic, and the topic."""
    with system.topics.watch(name) as watch:
        statuses = Statuses(PAGE_VIEW_BYTES)
        topic = KnownTopic(watch, "diagnostic_msgs/DiagnosticArray", statuses.add)
        with topic.listening():
            yield statuses, topic
