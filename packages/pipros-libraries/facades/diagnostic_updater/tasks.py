"""Diagnostic tasks, which an `Updater` runs."""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Any

import rospy
from diagnostic_updater.status import DiagnosticStatusWrapper
from pipros_libraries.diagnostics.frequency import EventWindow, judged
from pipros_libraries.diagnostics.stamps import StampDelays


class DiagnosticTask:
    """Base class of tasks, which write a report when they run."""

    def __init__(self, name: str) -> None:
        self.name = name

    def getName(self) -> str:
        """Return the name of the task."""
        return self.name

    def run(self, stat: Any) -> Any:
        """Return the status unchanged. Subclasses override this method to write a report to the status."""
        return stat


class FunctionDiagnosticTask(DiagnosticTask):
    """Task implemented by a function, which takes a status and returns it."""

    def __init__(self, name: str, fn: Callable[[Any], Any]) -> None:
        super().__init__(name)
        self.fn = fn

    def run(self, stat: Any) -> Any:
        """Call the function with the status, and return its result."""
        return self.fn(stat)


class CompositeDiagnosticTask(DiagnosticTask):
    """Several tasks with a joint report, which contains all their values and a merged summary."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.tasks: list[Any] = []

    def addTask(self, t: Any) -> None:
        """Add a task."""
        self.tasks.append(t)

    def run(self, stat: Any) -> Any:
        """Run all tasks in order."""
        before, combined = DiagnosticStatusWrapper(), DiagnosticStatusWrapper()
        before.summary(stat)
        for task in self.tasks:
            stat.summary(before)
            stat = task.run(stat)
            combined.mergeSummary(stat)
        stat.summary(combined)
        return stat


class FrequencyStatusParam:
    """Parameters of a FrequencyStatus.

    Args:
        freq_bound: a dictionary with `min` and optionally `max`, in Hz.
        tolerance: the accepted relative deviation from these bounds.
        window_size: the number of reports over which the frequency is averaged.
    """

    def __init__(self, freq_bound: dict[str, float], tolerance: float = 0.1, window_size: int = 5) -> None:
        self.freq_bound = freq_bound
        self.tolerance = tolerance
        self.window_size = window_size


class FrequencyStatus(DiagnosticTask):
    """Task that reports how frequently `tick` is called."""

    def __init__(self, params: FrequencyStatusParam, name: str = "FrequencyStatus") -> None:
        super().__init__(name)
        self.params = params
        self.lock = Lock()
        self.clear()

    def clear(self) -> None:
        """Reset the event counts."""
        with self.lock:
            self._window = EventWindow(self.params.window_size, rospy.get_time())

    def tick(self) -> None:
        """Count an event."""
        with self.lock:
            self._window.count += 1

    def run(self, stat: Any) -> Any:
        """Report the frequency of events over the last `window_size` reports."""
        bounds, tolerance = self.params.freq_bound, self.params.tolerance
        least = bounds["min"] * (1 - tolerance)
        most = bounds["max"] * (1 + tolerance) if "max" in bounds else None
        with self.lock:
            events, seconds, hz = self._window.report(rospy.get_time())
            total = self._window.count
        stat.summary(*judged(events, hz, least, most))
        stat.add("Events in window", f"{events}")
        stat.add("Events since startup", f"{total}")
        stat.add("Duration of window (s)", f"{seconds:f}")
        stat.add("Actual frequency (Hz)", f"{hz:f}")
        if bounds.get("max") == bounds["min"]:
            stat.add("Target frequency (Hz)", f"{bounds['min']:f}")
        if bounds["min"] > 0:
            stat.add("Minimum acceptable frequency (Hz)", f"{least:f}")
        if most is not None:
            stat.add("Maximum acceptable frequency (Hz)", f"{most:f}")
        return stat


class TimeStampStatusParam:
    """Parameters of a TimeStampStatus.

    The two values bound the accepted age in seconds. The age of a future timestamp is negative.
    """

    def __init__(self, min_acceptable: float = -1, max_acceptable: float = 5) -> None:
        self.max_acceptable = max_acceptable
        self.min_acceptable = min_acceptable


class TimeStampStatus(DiagnosticTask):
    """Task that reports the age of the timestamps passed to `tick`."""

    def __init__(self, params: TimeStampStatusParam | None = None, name: str = "Timestamp Status") -> None:
        super().__init__(name)
        self.params = params or TimeStampStatusParam()
        self.lock = Lock()
        self._delays = StampDelays()

    def tick(self, stamp: Any) -> None:
        """Record the age of a timestamp, which is a `rospy.Time` or a number of seconds."""
        seconds = stamp if isinstance(stamp, int | float) else stamp.to_sec()
        with self.lock:
            self._delays.add(seconds, rospy.get_time())

    def run(self, stat: Any) -> Any:
        """Report the timestamps passed to `tick` since the last report."""
        least, greatest = self.params.min_acceptable, self.params.max_acceptable
        with self.lock:
            delays = self._delays
            stat.summary(*delays.judged(least, greatest))
            stat.add("Earliest timestamp delay:", f"{delays.least:f}")
            stat.add("Latest timestamp delay:", f"{delays.greatest:f}")
            stat.add("Earliest acceptable timestamp delay:", f"{least:f}")
            stat.add("Latest acceptable timestamp delay:", f"{greatest:f}")
            stat.add("Late diagnostic update count:", f"{delays.late_count}")
            stat.add("Early diagnostic update count:", f"{delays.early_count}")
            stat.add("Zero seen diagnostic update count:", f"{delays.zero_count}")
            delays.forget()
        return stat


class Heartbeat(DiagnosticTask):
    """Task that reports that the node is alive."""

    def __init__(self) -> None:
        super().__init__("Heartbeat")

    def run(self, stat: Any) -> Any:
        """Report OK."""
        stat.summary(0, "Alive")
        return stat
