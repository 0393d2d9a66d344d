"""Order measurements, including late ones, by time, and apply them to a filter.

Times are floating-point seconds, as in robot_localization, so that both publish the same timestamps.
"""

from __future__ import annotations

import bisect
import heapq
import itertools
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from pipros_robot.navigation.filter.kalman import ExtendedKalmanFilter
from pipros_robot.navigation.filter.state import Array, Measurement, VelocityCommand

GAP_S: Final = 100_000.0
"""A longer time between two measurements is treated as a clock change, and replaced by 0.01 s."""
QUEUED: Final = 100_000
"""Maximum number of measurements that wait for their time; further ones are dropped."""
KEPT: Final = 100_000
"""Maximum number of measurements and states in the history; the oldest are dropped."""

_SAME_TIME_S: Final = 1e-9
_Snapshot = tuple[float, Array, Array, VelocityCommand | None]


class Timeline:
    """Applies queued measurements to a filter. Not thread-safe.

    Attributes:
        time_s: time of the estimate; None before the first measurement.
        is_history_too_short: whether the last late measurement was older than the history.
        failures: the inputs whose last measurements were dropped, because the filter failed with them.
    """

    def __init__(
        self,
        kalman: ExtendedKalmanFilter,
        *,
        sensor_timeout_s: float,
        history_s: float | None = None,
        predicts_always: bool = False,
    ) -> None:
        """Store the options.

        Args:
            sensor_timeout_s: time without measurements after which the state is predicted.
            history_s: length of the history for late measurements. If None, late measurements only correct
                the newest state.
            predicts_always: whether to predict to the current time in each cycle.
        """
        self.kalman = kalman
        self.time_s: float | None = None
        self.is_history_too_short = False
        self.failures: set[str] = set()
        self._first = kalman.state.copy(), kalman.covariance.copy()
        self._timeout_s = sensor_timeout_s
        self._history_s = history_s
        self._predicts_always = predicts_always
        self._counter = itertools.count()
        self._queue: list[tuple[float, int, Measurement]] = []
        self._applied: deque[Measurement] = deque(maxlen=KEPT)
        self._snapshots: deque[_Snapshot] = deque(maxlen=KEPT)

    @property
    def has_started(self) -> bool:
        return self.time_s is not None

    def add(self, measurement: Measurement) -> None:
        """Queue a measurement, with the newest command. Measurements with the same time keep their order."""
        if self.kalman.control is not None:
            measurement = replace(measurement, command=self.kalman.control.command)
        self._push(measurement)

    def _push(self, measurement: Measurement) -> None:
        if len(self._queue) < QUEUED:
            heapq.heappush(self._queue, (measurement.time_s, next(self._counter), measurement))

    def clear(self, time_s: float | None) -> None:
        """Discard all measurements and the history, and continue at `time_s`.

        If `time_s` is None, the next measurement becomes the initial estimate.
        """
        self._queue.clear()
        self._applied.clear()
        self._snapshots.clear()
        self.time_s = time_s

    def reset(self) -> None:
        """Return to the initial estimate."""
        self.clear(None)
        if self.kalman.control is not None:
            self.kalman.control.command = None
        self.kalman.state, self.kalman.covariance = (part.copy() for part in self._first)

    def advance(self, now_s: float) -> None:
        """Apply the queued measurements up to now. If none are queued, predict after the sensor timeout.

        With `predicts_always`, predict to the current time in any case.
        """
        predicts = self._predicts_always
        if self._queue:
            restored = self._rewind(self._queue[0][0])
            while self._queue and self._queue[0][0] <= now_s:
                measurement = heapq.heappop(self._queue)[2]
                if restored > 0 and self.kalman.control is not None:
                    self.kalman.control.command = measurement.command
                restored -= 1
                self._apply(measurement)
            self._trim()
        elif self.time_s is not None and now_s - self.time_s >= self._timeout_s:
            predicts = True
        if predicts and self.time_s is not None:
            delta_s = _checked(now_s - self.time_s)
            self.time_s += delta_s
            self._predict(now_s, delta_s)

    def _apply(self, measurement: Measurement) -> None:
        if self.time_s is None:
            self.kalman.start(measurement)
            self.time_s = measurement.time_s
        else:
            delta_s = measurement.time_s - self.time_s
            self.time_s = max(self.time_s, measurement.time_s)
            if delta_s > 0:
                self._predict(measurement.time_s, _checked(delta_s))
            before = self.kalman.state.copy(), self.kalman.covariance.copy()
            if not self._succeeds(partial(self.kalman.correct, measurement)):
                self.failures.add(measurement.source)
                self.kalman.state, self.kalman.covariance = before
        if self._history_s is not None:
            self._applied.append(measurement)
            if not self._queue or abs(self._queue[0][0] - self.time_s) > _SAME_TIME_S:
                self._save(self.time_s)

    def _predict(self, time_s: float, delta_s: float) -> None:
        """Predict. If the result is not finite, continue with the initial estimate."""
        if not self._succeeds(partial(self.kalman.predict, time_s, delta_s)):
            self.failures.add("the prediction")
            self.kalman.state, self.kalman.covariance = (part.copy() for part in self._first)

    def _succeeds(self, step: Callable[[], object]) -> bool:
        try:
            with np.errstate(all="ignore"):
                step()
        except np.linalg.LinAlgError:
            return False
        return bool(np.isfinite(self.kalman.state).all() and np.isfinite(self.kalman.covariance).all())

    def _save(self, time_s: float) -> None:
        control = self.kalman.control
        command = None if control is None else control.command
        self._snapshots.append((time_s, self.kalman.state.copy(), self.kalman.covariance.copy(), command))

    def _rewind(self, time_s: float) -> int:
        """Restore the last state before a late measurement. Return the number of measurements to reapply."""
        if self._history_s is None or self.time_s is None or time_s >= self.time_s or not self._snapshots:
            return 0
        before = bisect.bisect_right(self._snapshots, time_s - _SAME_TIME_S, key=lambda kept: kept[0])
        self.is_history_too_short = before == 0
        while len(self._snapshots) > max(before, 1):
            self._snapshots.pop()
        self.time_s, state, covariance, command = self._snapshots[-1]
        self.kalman.state, self.kalman.covariance = state.copy(), covariance.copy()
        if self.kalman.control is not None:
            self.kalman.control.command = command
        count = 0
        while self._applied and self._applied[-1].time_s > self.time_s:
            self._push(self._applied.pop())
            count += 1
        return count

    def _trim(self) -> None:
        if self._history_s is not None and self.time_s is not None:
            oldest_s = self.time_s - self._history_s
            while self._applied and self._applied[0].time_s < oldest_s:
                self._applied.popleft()
            while self._snapshots and self._snapshots[0][0] < oldest_s:
                self._snapshots.popleft()


def _checked(delta_s: float) -> float:
    return 0.01 if delta_s > GAP_S else delta_s
