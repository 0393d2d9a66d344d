"""Fuse the motions of several sensors to a pose.

In each step, a sensor measures the motion since the last step: its pose at the end, relative to its pose at
the beginning. The motions are weighted by their covariances, and continue the estimated pose. Roll and pitch
of an IMU, and positions of a satellite receiver, are absolute.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from pipros_libraries.transforms.pose import (
    Pose,
    composed,
    from_roll_pitch_yaw,
    interpolate,
    inverted,
    roll_pitch_yaw,
)
from pipros_robot.navigation.filter.kalman import ExtendedKalmanFilter
from pipros_robot.navigation.filter.state import POSE, SIZE, Array, Flags, Measurement

KEPT: Final = 1000
"""Maximum number of poses of a sensor that wait for those of others; the oldest are dropped."""
_UNKNOWN: Final = 1e6
"""Variance of a variable before the motions of a step are known."""

_X, _Y, _Z, _ROLL, _PITCH, _YAW = range(6)


class MeasuredVariables(NamedTuple):
    """The variables of the pose that a sensor measures: their changes, and their values."""

    changes: tuple[int, ...] = ()
    values: tuple[int, ...] = ()


KINDS: Final[Mapping[str, MeasuredVariables]] = {
    "odom": MeasuredVariables(changes=(_X, _Y, _YAW)),
    "imu": MeasuredVariables(changes=(_YAW,), values=(_ROLL, _PITCH)),
    "vo": MeasuredVariables(changes=(_X, _Y, _Z, _ROLL, _PITCH, _YAW)),
    "gps": MeasuredVariables(values=(_X, _Y, _Z)),
}


class PoseSensor:
    """The newest poses of a sensor, in the order of their times.

    Attributes:
        last: its pose at the end of the last step.
        received: number of poses that were added.
    """

    def __init__(self, kind: MeasuredVariables) -> None:
        self.kind = kind
        self.last: Pose | None = None
        self.received = 0
        self._poses: deque[tuple[float, Pose, Array]] = deque(maxlen=KEPT)

    @property
    def newest_s(self) -> float:
        return self._poses[-1][0] if self._poses else -np.inf

    def add(self, time_s: float, pose: Pose, covariance: Array) -> bool:
        """Add a pose and its 6 x 6 covariance. Return False if it is not newer than the last one."""
        if time_s <= self.newest_s:
            return False
        self.received += 1
        self._poses.append((time_s, pose, covariance))
        return True

    def at(self, time_s: float) -> tuple[Pose, Array]:
        """Return the pose at a time between the poses, by interpolation, and drop earlier poses."""
        index = bisect_left(self._poses, time_s, key=lambda each: each[0])
        later = self._poses[min(index, len(self._poses) - 1)]
        earlier = self._poses[max(index - 1, 0)]
        for _ in range(index - 1):
            self._poses.popleft()
        span_s = later[0] - earlier[0]
        ratio = min(max((time_s - earlier[0]) / span_s, 0.0), 1.0) if span_s > 0 else 1.0
        return interpolate(earlier[1], later[1], ratio), later[2]


class Fusion:
    """The estimated pose, and the sensors. Not thread-safe.

    Attributes:
        kalman: the filter, of whose variables only those of the pose are used.
        time_s: the time of the estimate; None before the first one.
    """

    def __init__(self, names: list[str], timeout_s: float) -> None:
        """Create the sensors with these names of `KINDS`. They are left out after `timeout_s` of silence."""
        self.sensors = {name: PoseSensor(KINDS[name]) for name in names}
        self.kalman = ExtendedKalmanFilter()
        self.time_s: float | None = None
        self._timeout_s = timeout_s
        self._places = [name for name in names if name != "imu"]

    @property
    def pose(self) -> Pose:
        x, y, z, *angles = self.kalman.state[POSE].tolist()
        return (x, y, z, *from_roll_pitch_yaw(*angles))

    def step(self, now_s: float) -> bool:
        """Continue the estimate up to the newest time of which all sensors know. Return False without one.

        Sensors without a pose in the last `timeout_s` do not count.
        """
        active = {
            name: each for name, each in self.sensors.items() if each.newest_s > now_s - self._timeout_s
        }
        for name in self.sensors.keys() - active.keys():
            self.sensors[name].last = None
        if self.time_s is None and self._places and not active.keys() & {*self._places}:
            return False
        time_s = min((each.newest_s for each in active.values()), default=-np.inf)
        if not np.isfinite(time_s) or (self.time_s is not None and time_s <= self.time_s):
            return False
        found = {name: each.at(time_s) for name, each in active.items()}
        if self.time_s is None:
            self._start(found)
        else:
            self._fuse(found, time_s, time_s - self.time_s)
        for name, (pose, _) in found.items():
            self.sensors[name].last = pose
        self.time_s = time_s
        return True

    def _start(self, found: Mapping[str, tuple[Pose, Array]]) -> None:
        for name in ("vo", "odom", "imu", "gps"):  # later ones take precedence
            if name in found:
                pose, covariance = found[name]
                kind = KINDS[name]
                used = [*kind.values, *(kind.changes if name != "imu" or not self._places else ())]
                values = np.array((*pose[:3], *roll_pitch_yaw(pose)))
                self.kalman.state[used] = values[used]
                self.kalman.covariance[np.ix_(used, used)] = covariance[np.ix_(used, used)]

    def _fuse(self, found: Mapping[str, tuple[Pose, Array]], time_s: float, delta_s: float) -> None:
        kalman, old = self.kalman, self.pose
        before, values = kalman.covariance.copy(), kalman.state.copy()
        motions = {name: each for name, each in found.items() if self.sensors[name].last is not None}
        moved = sorted({index for name in motions for index in KINDS[name].changes})
        kalman.covariance[moved, :] = kalman.covariance[:, moved] = 0.0
        kalman.covariance[moved, moved] = _UNKNOWN
        for name, (pose, covariance) in motions.items():
            last = self.sensors[name].last
            if last is not None and KINDS[name].changes:
                target = _continued(old, last, pose, name)
                self._correct(name, KINDS[name].changes, target, covariance * delta_s**2, time_s)
        kalman.covariance[np.ix_(moved, moved)] += before[np.ix_(moved, moved)]
        for name, (pose, covariance) in found.items():
            target = np.array((*pose[:3], *roll_pitch_yaw(pose)))
            self._correct(name, KINDS[name].values, target, covariance, time_s)
        if not (np.isfinite(kalman.state).all() and np.isfinite(kalman.covariance).all()):
            kalman.state, kalman.covariance = values, before

    def _correct(
        self, name: str, indices: tuple[int, ...], target: Array, covariance: Array, time_s: float
    ) -> None:
        if indices:
            flags: Flags = np.zeros(SIZE, bool)
            flags[[*indices]] = True
            whole, values = np.zeros((SIZE, SIZE)), np.zeros(SIZE)
            whole[POSE, POSE], values[POSE] = covariance, target
            self.kalman.correct(Measurement(name, time_s, values, whole, flags))


def _continued(old: Pose, last: Pose, pose: Pose, name: str) -> Array:
    """Return the estimated pose after the motion of a sensor, as x, y, z, roll, pitch, yaw."""
    if name == "imu":
        angles = np.array(roll_pitch_yaw(old))
        angles[2] += roll_pitch_yaw(pose)[2] - roll_pitch_yaw(last)[2]
        return np.array((*old[:3], *angles))
    moved = composed(old, composed(inverted(last), pose))
    return np.array((*moved[:3], *roll_pitch_yaw(moved)))
