"""The diagnostics of a filter node: its settings, its inputs, and the rate of its output."""

from __future__ import annotations

import threading
import time
from typing import Final

import numpy as np

from pipros.node import Node
from pipros_libraries.diagnostics.frequency import EventWindow, judged
from pipros_libraries.diagnostics.link_status import LinkDiagnostics, LinkLevel, LinkStatus
from pipros_robot.navigation.filter.settings import FilterSettings
from pipros_robot.navigation.filter.state import Measurement

OK, WARN, ERROR = LinkLevel
_NAMES: Final = ("X", "Y", "Z", "ROLL", "PITCH", "YAW")
_LARGE: Final = 1000.0
_PERIOD_S: Final = 1.0


class Health:
    """Publishes `/diagnostics` about once per second, in `tick`, if `print_diagnostics` is set."""

    def __init__(self, node: Node, settings: FilterSettings) -> None:
        self._node, self._settings = node, settings
        self._lock = threading.Lock()
        self._static = problems(settings)
        self._dynamic: dict[str, tuple[LinkLevel, str]] = {}
        self._window = EventWindow(10, time.monotonic())
        self._due_s = time.monotonic() + _PERIOD_S
        self._out = LinkDiagnostics(node, "none") if settings.print_diagnostics else None

    def warn(self, key: str, text: str) -> None:
        """Report a problem in the next diagnostics."""
        with self._lock:
            self._dynamic[key] = WARN, text

    def check(self, measurement: Measurement) -> None:
        """Warn if a measured variance is zero, negative or very large."""
        variances = measurement.covariance.diagonal()[measurement.flags]
        for is_wrong, text in (
            (variances > _LARGE, f"a variance is greater than {_LARGE:g}"),
            (variances < 0, "a variance is negative"),
            (variances == 0, "a variance is zero"),
        ):
            if np.any(is_wrong):
                self.warn(f"{measurement.source} covariance", text)

    def tick(self) -> None:
        """Count an estimate, and publish diagnostics if they are due."""
        self._window.count += 1
        now_s = time.monotonic()
        if self._out is None or now_s < self._due_s:
            return
        self._due_s = now_s + _PERIOD_S
        with self._lock:
            found = {**self._static, **self._dynamic}
            self._dynamic.clear()
        level = max((each[0] for each in found.values()), default=OK)
        text = "The robot's state is estimated"
        if level != OK:
            text = "; ".join(each[1] for each in found.values())
        events, _, hz = self._window.report(now_s)
        wanted = self._settings.frequency
        rate = judged(events, hz, (wanted - 2) * 0.9, (wanted + 2) * 1.1)
        name, values = self._node.name.lstrip("/"), {"Actual frequency (Hz)": f"{hz:.3f}"}
        texts = {key: each[1] for key, each in found.items()}
        self._out.publish(
            (
                LinkStatus(f"{name}: Filter diagnostic updater", level, text, texts),
                LinkStatus(f"{name}: odometry/filtered topic status", LinkLevel(rate[0]), rate[1], values),
            )
        )


def problems(settings: FilterSettings) -> dict[str, tuple[LinkLevel, str]]:
    """Return the level and text of each problem in the settings, by variable or input."""
    used = [topic for topic in settings.topics if topic.is_used]
    absolute, moving = np.zeros(6, int), np.zeros(6, int)
    for topic in used:
        rates = topic.twist.flags[6:12].astype(int)
        if topic.pose.is_differential:
            moving += topic.pose.flags[:6]
        else:
            absolute += topic.pose.flags[:6]
        moving += rates
    unused = (each.name for each in settings.topics if each not in used)
    found = {name: (WARN, f"{name} uses no variables") for name in unused}
    for index, name in enumerate(_NAMES):
        if absolute[index] > 1:
            count = absolute[index]
            found[name] = WARN, f"{count} absolute sources of {name}; all but one should be differential"
        elif not absolute[index] and not moving[index] and not (settings.two_d_mode and 2 <= index <= 4):
            found[name] = ERROR, f"{name} has no source: its variance will grow without limit"
    return found
