"""Diagnostics: the status of each component with values and history, as in `rqt_robot_monitor`."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

from pipros.errors import PiprosError
from pipros.node.any_msg import RawMessage
from pipros.web.topic_watch import TopicWatch
from pipros.web.watched_system import WatchedSystem

TOPICS = ("/diagnostics_agg", "/diagnostics")
SEND_INTERVAL_S = 0.5
STALE_S = 5.0
MOST_COMPONENTS = 3000
HISTORY = 60
STALE = 3
"""The level of a component that has not reported for `STALE_S`."""


@dataclass(slots=True)
class Status:
    """The newest status of a component.

    Attributes:
        level: 0 OK, 1 warning, 2 error, 3 stale.
        history: the newest levels, with the wall times of their arrival.
    """

    level: int
    message: str
    hardware: str
    values: list[list[str]]
    last_s: float
    history: deque[tuple[float, int]] = field(default_factory=lambda: deque(maxlen=HISTORY))


class Statuses:
    """All components that have reported. Messages are added in the threads of the links."""

    def __init__(self) -> None:
        self._statuses: dict[str, Status] = {}
        self._lock = threading.Lock()

    def add(self, message: Any, wall_s: float) -> None:
        """Adds a `diagnostic_msgs/DiagnosticArray`."""
        with self._lock:
            for status in message.status:
                known = self._statuses.get(status.name)
                if known is None and len(self._statuses) >= MOST_COMPONENTS:
                    continue
                history = known.history if known else deque(maxlen=HISTORY)
                level = status.level if isinstance(status.level, int) else ord(status.level)
                history.append((round(wall_s, 1), level))
                values = [[pair.key, pair.value] for pair in status.values[:200]]
                self._statuses[status.name] = Status(
                    level, status.message, status.hardware_id, values, wall_s, history
                )

    def rows(self, now_s: float) -> list[Mapping[str, Any]]:
        """The components, sorted by name."""
        with self._lock:
            return [
                {
                    "name": name,
                    "level": STALE if now_s - status.last_s > STALE_S else status.level,
                    "message": status.message,
                    "hardware": status.hardware,
                    "values": status.values,
                    "age": round(now_s - status.last_s, 1),
                    "history": list(status.history),
                }
                for name, status in sorted(self._statuses.items())
            ]


class DiagnosticViews:
    """The view of the Diagnostics tab."""

    def __init__(self, system: WatchedSystem) -> None:
        self._system = system

    async def diagnostics(self, _: Mapping[str, Any]) -> AsyncIterator[Any]:
        """All components; from the aggregator if there is one."""
        observations = self._system.observations()
        observation = await anext(observations)
        topics = [topic for topic in TOPICS if topic in observation.state.publishers][:1] or list(TOPICS)
        statuses = Statuses()
        with ExitStack() as stack:
            for topic in topics:
                watch = stack.enter_context(self._system.topics.watch(topic))
                stack.enter_context(watch.listening(_listener_for(statuses, watch)))
            while True:
                yield {"components": statuses.rows(time.time()), "topics": topics}
                await asyncio.sleep(SEND_INTERVAL_S)


def _listener_for(statuses: Statuses, watch: TopicWatch) -> Any:
    def add_decoded(message: RawMessage, wall_s: float) -> None:
        try:
            decoded = watch.decode(message)
        except PiprosError:
            return
        statuses.add(decoded, wall_s)

    return add_decoded
