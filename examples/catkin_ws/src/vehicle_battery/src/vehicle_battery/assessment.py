"""Assess whether a charge is ok, low or critical, and how long it will last. Independent of ROS."""

import math
from collections import deque
from dataclasses import dataclass, replace

OK, LOW, CRITICAL, UNKNOWN = range(4)  # as in BatteryWarning.msg
_SEVERITY = {OK: 0, LOW: 1, UNKNOWN: 2, CRITICAL: 3}

_WINDOW_S = 300.0
_SHORTEST_WINDOW_S = 3.0
_SAMPLES = 600
_TIME_HYSTERESIS = 1.2


@dataclass(frozen=True)
class Limits:
    """The limits of a monitor. Charges are from 0 to 1."""

    low: float = 0.25
    critical: float = 0.10
    hysteresis: float = 0.02
    minutes_left: float = 10.0


@dataclass(frozen=True)
class Assessment:
    """The state of a battery. `time_left` is in seconds, or NaN while the battery is not discharging."""

    level: int
    percentage: float
    time_left: float
    acknowledged: bool

    @property
    def text(self):
        """The assessment as one line of text."""
        if self.level == UNKNOWN:
            return "the charge of the battery is unknown"
        word = {OK: "battery", LOW: "battery low", CRITICAL: "battery critical"}[self.level]
        line = f"{word}: {100 * self.percentage:.0f} %"
        if not math.isnan(self.time_left):
            line += f", empty in {_duration(self.time_left)}"
        return line


class Assessor:
    """Assesses one battery over time.

    A level begins below its limit, and ends when the charge exceeds the limit by the hysteresis, so that a
    fluctuating charge does not cause repeated warnings. An acknowledgement is valid until the level gets
    worse or returns to OK.
    """

    def __init__(self, limits=None):
        self.limits = limits or Limits()
        self._last = Assessment(OK, math.nan, math.nan, acknowledged=False)
        self._samples = deque(maxlen=_SAMPLES)

    def update(self, stamp, percentage):
        """Return the assessment for a charge (0 to 1, NaN if unknown) at a time in seconds.

        If the time is earlier than in the last call, because a bag was restarted or a simulation was reset,
        earlier samples are discarded.
        """
        if self._samples and stamp < self._samples[-1][0]:
            self._samples.clear()
        if not math.isnan(percentage):
            self._samples.append((stamp, percentage))
            while stamp - self._samples[0][0] > _WINDOW_S:
                self._samples.popleft()
        time_left = self._time_left()
        level, before = self._judge(percentage, time_left), self._last
        is_acknowledged = before.acknowledged and level != OK and _SEVERITY[level] <= _SEVERITY[before.level]
        self._last = Assessment(level, percentage, time_left, is_acknowledged)
        return self._last

    def acknowledge(self):
        """Acknowledge the level, and return the assessment; return None if the level is OK."""
        if self._last.level == OK:
            return None
        self._last = replace(self._last, acknowledged=True)
        return self._last

    def _judge(self, percentage, time_left):
        if math.isnan(percentage):
            return UNKNOWN
        limits, before = self.limits, self._last.level

        def is_below(limit, level):
            was_below = before != UNKNOWN and before >= level
            return percentage < limit + (limits.hysteresis if was_below else 0.0)

        if is_below(limits.critical, CRITICAL):
            return CRITICAL
        soon = 60 * limits.minutes_left * (_TIME_HYSTERESIS if before == LOW else 1.0)
        return LOW if is_below(limits.low, LOW) or time_left < soon else OK

    def _time_left(self):
        """Extrapolate a straight line through the samples of the last minutes (least squares)."""
        if not self._samples or self._samples[-1][0] - self._samples[0][0] < _SHORTEST_WINDOW_S:
            return math.nan
        count = len(self._samples)
        last_time, last_value = self._samples[-1]
        times = [time - last_time for time, _ in self._samples]
        values = [value for _, value in self._samples]
        mean_time, mean_value = sum(times) / count, sum(values) / count
        spread = sum((time - mean_time) ** 2 for time in times)
        slope = sum((t - mean_time) * (v - mean_value) for t, v in zip(times, values)) / spread
        return -last_value / slope if slope < 0 else math.nan


def _duration(seconds):
    minutes = int(seconds // 60)
    if minutes >= 60:
        return f"{minutes // 60} h {minutes % 60} min"
    return f"{minutes} min" if minutes else f"{seconds:.0f} s"
