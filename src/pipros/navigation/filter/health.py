"""The diagnostics of a filter node: its settings, its inputs, and the rate of its output."""

from __future__ import annotations

import threading
import time
from typing import Any, Final

import numpy as np

from pipros.libraries.diagnostics.frequency import EventWindow, judged
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.navigation.filter.settings import Settings
from pipros.navigation.filter.state import Measurement
from pipros.node import Node

OK, WARN, ERROR = 0, 1, 2
_NAMES: Final = ("X", "Y", "Z", "ROLL", "PITCH", "YAW")
_LARGE: Final = 1000.0
_PERIOD_S: Final = 1.0


class Health:
    """Publishes `/diagnostics` about once per second, from the thread that reports an estimate."""

    def __init__(self, node: Node, settings: Settings) -> None:
        self._node, self._settings = node, settings
        self._lock = threading.Lock()
        self._static = problems(settings)
        self._dynamic: dict[str, tuple[int, str]] = {}
        self._window = EventWindow(10, time.monotonic())
        self._due_s = time.monotonic() + _PERIOD_S
        if settings.has_diagnostics:
            self._array_class: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
            self._status_class: Any = load_message_class("diagnostic_msgs/DiagnosticStatus")
            self._value_class: Any = load_message_class("diagnostic_msgs/KeyValue")
            self._publisher = node.advertise("/diagnostics", self._array_class, queue_size=1)

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
        """Count an estimate; publish if it is time."""
        self._window.count += 1
        if self._settings.has_diagnostics and time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + _PERIOD_S
            self._publish()

    def _publish(self) -> None:
        with self._lock:
            found = {**self._static, **self._dynamic}
            self._dynamic.clear()
        level = max((each[0] for each in found.values()), default=OK)
        text = (
            "The robot's state is estimated" if level == OK else "; ".join(each[1] for each in found.values())
        )
        events, _, hz = self._window.report(time.monotonic())
        wanted = self._settings.frequency
        rate = judged(events, hz, (wanted - 2) * 0.9, (wanted + 2) * 1.1)
        name = self._node.name.lstrip("/")
        array = self._array_class()
        array.header.stamp = Time(*divmod(self._node.clock.now_ns(), 1_000_000_000))
        array.status = [
            self._status_class(
                level=level,
                name=f"{name}: Filter diagnostic updater",
                message=text,
                hardware_id="none",
                values=[self._value_class(key, each[1]) for key, each in found.items()],
            ),
            self._status_class(
                level=rate[0],
                name=f"{name}: odometry/filtered topic status",
                message=rate[1],
                hardware_id="none",
                values=[self._value_class("Actual frequency (Hz)", f"{hz:.3f}")],
            ),
        ]
        self._publisher.publish(array)


def problems(settings: Settings) -> dict[str, tuple[int, str]]:
    """Return the problems of the settings: level and text, by variable or input."""
    used = [topic for topic in settings.topics if topic.is_used]
    absolute, moving = np.zeros(6, int), np.zeros(6, int)
    for topic in used:
        rates = topic.twist.flags[6:12].astype(int)
        if topic.pose.is_differential:
            moving += topic.pose.flags[:6]
        else:
            absolute += topic.pose.flags[:6]
        moving += rates
    found = {
        topic.name: (WARN, f"{topic.name} uses no variables")
        for topic in settings.topics
        if topic not in used
    }
    for index, name in enumerate(_NAMES):
        if absolute[index] > 1:
            found[name] = (
                WARN,
                f"{absolute[index]} absolute sources of {name}; all but one should be differential",
            )
        elif not absolute[index] and not moving[index] and not (settings.in_plane and 2 <= index <= 4):
            found[name] = ERROR, f"{name} has no source: its variance will grow without limit"
    return found
