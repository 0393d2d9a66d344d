"""Make measurements from poses, twists and accelerations in ROS messages, in any frame.

Poses are converted to the world frame, and twists and accelerations to the robot's frame. Flags and
covariances are rotated accordingly: a rotated variable counts as measured if any measured variable
contributes to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Any, Final

import numpy as np

from pipros_libraries.transforms.pose import (
    IDENTITY,
    Pose,
    composed,
    from_roll_pitch_yaw,
    inverted,
    roll_pitch_yaw,
    rotation_matrix,
)
from pipros_robot.navigation.filter.state import (
    ACCELERATION,
    ANGLES,
    OUT_OF_PLANE,
    POSE,
    POSITION,
    RATES,
    SIZE,
    TWIST,
    VELOCITY,
    Array,
    Flags,
    Measurement,
    UnusableMeasurement,
    rotation,
)
from pipros_robot.navigation.plane import MOST

_TOUCHED: Final = 1e-6
"""A rotated flag is set if the corresponding row of the rotated flag matrix has at least this norm."""
_PLANE_VARIANCE: Final = 1e-6

Lookup = Callable[[str, str, int], Pose | None]
"""Function that returns the second frame's pose in the first frame at a time in ns, or None if unknown."""


@dataclass(frozen=True, slots=True, eq=False)
class InputSettings:
    """Settings for one kind of data from one input.

    Attributes:
        source: the name, such as `imu0_acceleration`.
        flags: mask of the variables to use, shape (15,).
        threshold: Mahalanobis distance at which measurements are rejected.
        is_differential: whether to use the differences of poses as velocities.
        is_relative: whether to use poses relative to the first pose.
        removes_gravity: whether to subtract gravity from accelerations.
    """

    source: str
    flags: Flags
    threshold: float = inf
    is_differential: bool = False
    is_relative: bool = False
    removes_gravity: bool = False


@dataclass(slots=True)
class Readings:
    """Makes measurements from data. Stores earlier poses of differential and relative inputs.

    Methods return None if a transform is missing or there is no earlier pose, and raise `UnusableMeasurement`
    if the data would spoil the estimate.

    Attributes:
        world, base: the frames of poses, and of twists and accelerations.
        lookup: function that returns transforms.
        in_plane: whether each measurement also sets the variables outside the plane to 0.
        gravity: gravitational acceleration in m/s².
        state: the newest estimate, used to correct for a sensor's distance from the robot's centre.
        angular_acceleration: the estimated angular acceleration in rad/s².
    """

    world: str
    base: str
    lookup: Lookup
    in_plane: bool
    gravity: float
    state: Array = field(default_factory=lambda: np.zeros(SIZE))
    angular_acceleration: Array = field(default_factory=lambda: np.zeros(3))
    _first: dict[str, Pose] = field(default_factory=dict)
    _previous: dict[str, tuple[int, Pose, Array]] = field(default_factory=dict)

    def forget(self) -> None:
        """Discard the earlier poses."""
        self._first.clear()
        self._previous.clear()

    def pose(
        self, sensor: InputSettings, frame: str, stamp_ns: int, pose: Pose, covariance: Array, child: str = ""
    ) -> Measurement | None:
        """Make a measurement from the pose of the frame `child` and its 6 x 6 covariance.

        If `child` is empty, the pose is that of the robot.
        """
        frame = frame or self.world
        target = self._find(self.world, self.world if sensor.is_differential else frame, stamp_ns)
        source = self._find(child, self.base, stamp_ns) if child else IDENTITY
        if target is None or source is None:
            return None
        turned = _matrix(target) @ _matrix(source).T
        return self._placed(sensor, stamp_ns, composed(pose, source), covariance, target, turned)

    def attitude(
        self, sensor: InputSettings, frame: str, stamp_ns: int, pose: Pose, covariance: Array
    ) -> Measurement | None:
        """Make a measurement from an IMU's orientation in the world. The IMU can be mounted in any way."""
        mounting = self._find(self.base, frame or self.base, stamp_ns)
        if mounting is None:
            return None
        offsets = roll_pitch_yaw(mounting)
        angles = np.array(roll_pitch_yaw(pose)) - offsets
        angles = np.array(roll_pitch_yaw((0.0, 0.0, 0.0, *from_roll_pitch_yaw(*angles))))
        level = rotation(0.0, 0.0, offsets[2])
        angles = level @ angles
        turned: Pose = (0.0, 0.0, 0.0, *from_roll_pitch_yaw(*angles))
        return self._placed(sensor, stamp_ns, turned, covariance, IDENTITY, level)

    def _placed(
        self,
        sensor: InputSettings,
        stamp_ns: int,
        pose: Pose,
        covariance: Array,
        target: Pose,
        matrix: Array,
    ) -> Measurement | None:
        flags = sensor.flags.copy()
        flags[POSITION], flags[ANGLES] = _turned(matrix, flags[POSITION]), _turned(matrix, flags[ANGLES])
        if (sensor.is_differential or sensor.is_relative) and not np.all(np.abs(pose) <= MOST):
            raise UnusableMeasurement("the pose must be finite, because later ones are relative to it")
        if sensor.is_differential:
            return self._difference(sensor, stamp_ns, pose, covariance, flags, _twice(matrix))
        if sensor.is_relative:
            pose = composed(inverted(self._first.setdefault(sensor.source, pose)), pose)
        pose = composed(target, pose)
        values = np.zeros(SIZE)
        values[POSE] = (*pose[:3], *roll_pitch_yaw(pose))
        both = _twice(matrix)
        return self._measurement(sensor, stamp_ns, values, POSE, both @ covariance @ both.T, flags)

    def _difference(
        self, sensor: InputSettings, stamp_ns: int, pose: Pose, covariance: Array, flags: Flags, both: Array
    ) -> Measurement | None:
        previous = self._previous.get(sensor.source)
        self._previous[sensor.source] = stamp_ns, pose, covariance
        if previous is None or stamp_ns <= previous[0]:
            return None
        delta_s = (stamp_ns - previous[0]) / 1e9
        moved = composed(inverted(previous[1]), pose)
        velocity = np.array((*moved[:3], *roll_pitch_yaw(moved))) / delta_s
        uncertainty = both @ (covariance + previous[2]) @ both.T * delta_s
        shifted = np.zeros(SIZE, bool)
        shifted[TWIST] = flags[POSE]
        wanted = InputSettings(sensor.source, shifted, sensor.threshold)
        return self.twist(wanted, self.base, stamp_ns, velocity, uncertainty)

    def twist(
        self, sensor: InputSettings, frame: str, stamp_ns: int, twist: Array, covariance: Array
    ) -> Measurement | None:
        """Make a measurement from linear and angular velocities and their 6 x 6 covariance."""
        target = self._find(self.base, frame or self.base, stamp_ns)
        if target is None:
            return None
        matrix = _matrix(target)
        values = np.zeros(SIZE)
        values[VELOCITY] = matrix @ twist[:3] + np.cross(target[:3], self.state[RATES])
        values[RATES] = matrix @ twist[3:]
        flags = sensor.flags.copy()
        flags[VELOCITY], flags[RATES] = _turned(matrix, flags[VELOCITY]), _turned(matrix, flags[RATES])
        both = _twice(matrix)
        return self._measurement(sensor, stamp_ns, values, TWIST, both @ covariance @ both.T, flags)

    def acceleration(
        self,
        sensor: InputSettings,
        frame: str,
        stamp_ns: int,
        acceleration: Array,
        covariance: Array,
        attitude: Pose | None,
    ) -> Measurement | None:
        """Make a measurement from an acceleration and its 3 x 3 covariance.

        `attitude` is the orientation measured by the IMU; None if the IMU does not measure orientations.
        """
        target = self._find(self.base, frame or self.base, stamp_ns)
        if target is None:
            return None
        matrix = _matrix(target)
        if sensor.removes_gravity:
            acceleration = acceleration - self._gravity(sensor, matrix, attitude)
        arm, rates = np.array(target[:3]), self.state[RATES]
        values = np.zeros(SIZE)
        values[ACCELERATION] = (
            matrix @ acceleration
            + np.cross(arm, self.angular_acceleration)
            - np.cross(np.cross(arm, rates), rates)
        )
        flags = sensor.flags.copy()
        flags[ACCELERATION] = _turned(matrix, flags[ACCELERATION])
        return self._measurement(
            sensor, stamp_ns, values, ACCELERATION, matrix @ covariance @ matrix.T, flags
        )

    def _gravity(self, sensor: InputSettings, mounting: Array, attitude: Pose | None) -> Array:
        """Return the acceleration that the sensor measures at rest, in its own frame."""
        up = np.array([0.0, 0.0, self.gravity])
        if attitude is None:
            orientation = rotation(*self.state[ANGLES]) @ mounting
        elif sensor.is_relative:
            orientation = _matrix(attitude) @ mounting
        else:
            orientation = _matrix(attitude)
        return np.asarray(orientation.T @ up)

    def _measurement(
        self,
        sensor: InputSettings,
        stamp_ns: int,
        values: Array,
        part: slice,
        covariance: Array,
        flags: Flags,
    ) -> Measurement:
        whole = np.zeros((SIZE, SIZE))
        whole[part, part] = covariance
        if self.in_plane:
            values[OUT_OF_PLANE], flags[OUT_OF_PLANE] = 0.0, True
            whole[OUT_OF_PLANE, OUT_OF_PLANE] = _PLANE_VARIANCE
        made = Measurement(sensor.source, seconds(stamp_ns), values, whole, flags, sensor.threshold)
        made.check()
        return made

    def _find(self, target: str, source: str, stamp_ns: int) -> Pose | None:
        found = self.lookup(target, source, stamp_ns)
        return IDENTITY if found is None and target == source else found


def seconds(stamp_ns: int) -> float:
    """Convert nanoseconds to floating-point seconds, with the rounding of roscpp's `toSec`."""
    whole, rest = divmod(stamp_ns, 1_000_000_000)
    return whole + 1e-9 * rest


def _matrix(pose: Pose) -> Array:
    return np.array(rotation_matrix(pose)).reshape(3, 3)


def _twice(matrix: Array) -> Array:
    both = np.zeros((6, 6))
    both[:3, :3] = both[3:, 3:] = matrix
    return both


def _turned(matrix: Array, flags: Flags) -> Any:
    return np.linalg.norm(matrix * flags, axis=1) >= _TOUCHED
