"""Measure the rates and losses of nodelets' inputs, and warn about nodelets that are too slow."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from pipros.node import Node
from pipros.node.hosted_node import HostedNode

SAMPLES: Final = 12
"""Number of samples over which rates are measured. Warnings are logged once per this many samples."""

PERIOD_S: Final = 5.0
"""Interval between samples."""


@dataclass(frozen=True, slots=True)
class InputState:
    """Statistics of a nodelet's input topic over the last minute.

    Attributes:
        rate_hz: messages per second, including dropped messages.
        received: number of messages, including dropped messages.
        dropped: number of messages that were dropped because the nodelet was too slow.
    """

    nodelet: str
    topic: str
    rate_hz: float
    received: int
    dropped: int

    def __str__(self) -> str:
        return f"{self.topic} {self.rate_hz:.1f} Hz, {self.dropped} of {self.received} dropped"


class _Sample(NamedTuple):
    """Total numbers of messages and of dropped messages by nodelet and topic, at one time."""

    time_s: float
    totals: Mapping[tuple[str, str], tuple[int, int]]


class InputWatch:
    """Logs a warning every minute for each nodelet input that dropped messages in that minute."""

    def __init__(
        self, host: Node, nodelets: Callable[[], Iterable[tuple[HostedNode, str]]], period_s: float = PERIOD_S
    ) -> None:
        self._host = host
        self._nodelets = nodelets
        self._period_s = period_s
        self._samples = deque([self._sample()], maxlen=SAMPLES)
        threading.Thread(target=self._run, name=f"inputs of {host.name}", daemon=True).start()

    def _run(self) -> None:
        count = 0
        while not self._host.wait_for_shutdown(self._period_s):
            count += 1
            if count % SAMPLES == 0:
                for state in self.states():
                    if state.dropped:
                        self._host.log.warning(
                            "nodelet %s is slower than its input: %s", state.nodelet, state
                        )
            self._samples.append(self._sample())

    def states(self) -> list[InputState]:
        """Return the state of each input over the last minute, or since the nodelet subscribed to it."""
        now, before = self._sample(), list(self._samples)
        states = []
        for key, (received, dropped) in now.totals.items():
            # Count from the last sample without the topic, or from the oldest sample.
            since = next((each for each in reversed(before) if key not in each.totals), before[0])
            old_received, old_dropped = since.totals.get(key, (0, 0))
            if received < old_received:  # the nodelet has subscribed again
                old_received = old_dropped = 0
            count = received - old_received
            rate_hz = count / max(now.time_s - since.time_s, 1e-3)
            states.append(InputState(*key, rate_hz, count, dropped - old_dropped))
        return states

    def _sample(self) -> _Sample:
        totals = {}
        for node, _ in self._nodelets():
            for each in node.subscribers:
                statistics = each.statistics()
                dropped = statistics["dropped"]
                totals[node.name, each.topic] = (statistics["frames"] + dropped, dropped)
        return _Sample(time.monotonic(), totals)
