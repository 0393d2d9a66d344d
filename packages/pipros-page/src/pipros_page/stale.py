"""Decide whether data is stale, because regular messages, transforms or reports have stopped.

Only this module and, for messages that the browser receives, `page/stale.js` make this decision.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pipros_tools.graph.observer import GraphObservation

LEAST_S, INTERVALS = 3.0, 10
"""Data is stale after `INTERVALS` times its mean interval, but not before `LEAST_S` (s)."""
REPORT_S = 5.0
"""A component that has not reported diagnostics for this time (s) is stale."""


def is_stale(age_s: float, interval_s: float | None) -> bool:
    """Return whether data that arrived every `interval_s` has stopped; False if the interval is unknown."""
    return interval_s is not None and age_s > max(LEAST_S, INTERVALS * interval_s)


@dataclass(frozen=True, slots=True)
class _Activity:
    """The time (s) at which a topic last had new messages, and the mean interval between its messages."""

    last_s: float
    interval_s: float


class TopicActivity:
    """Determines stale topics from their publishers' statistics in successive observations."""

    def __init__(self) -> None:
        self._active: dict[str, _Activity] = {}
        self._now_s = 0.0

    def add(self, observation: GraphObservation, now_s: float) -> None:
        """Add an observation that was made at `now_s`."""
        self._now_s = now_s
        quiet: set[str] = set()  # topics that are connected, unpublished, or published by an unreachable node
        for connection, traffic in observation.connections.items():
            quiet.add(connection.topic)
            known = self._active.get(connection.topic)
            if traffic is None:
                continue
            interval_s = traffic.interval_s or (known.interval_s if known and traffic.rate else None)
            if interval_s is not None:
                last_s = max(now_s - traffic.quiet_s, known.last_s if known else 0.0)
                self._active[connection.topic] = _Activity(last_s, interval_s)
        if observation.error:
            return
        dead = observation.unreachable
        publishers = observation.state.publishers
        quiet |= {
            topic for topic, nodes in publishers.items() if not nodes or any(node in dead for node in nodes)
        }
        quiet |= {topic for topic in observation.state.subscribers if not publishers.get(topic)}
        # A publisher that answers but has no connection sends nothing, so its rate is unknown.
        self._active = {topic: each for topic, each in self._active.items() if topic in quiet}

    def stale(self) -> Mapping[str, float]:
        """Return the stale topics, with the ages (s) of their last messages."""
        ages = {topic: (self._now_s - each.last_s, each.interval_s) for topic, each in self._active.items()}
        return {topic: age_s for topic, (age_s, interval_s) in ages.items() if is_stale(age_s, interval_s)}
