"""Settings of a simulated robot. The defaults describe a small indoor robot."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any, Final, TypeVar

from pipros_simulation.robots.battery import BatterySettings
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.errors import InvalidSettings

DRIVES: Final = ("diff", "omni", "ackermann", "car")
MAX_STEERING: Final = 0.6
"""Greatest angle of the steering of an `ackermann` drive without `min_turning_radius`, in radians."""
MAX_RAYS: Final = 10_000
"""Maximum number of rays of a scan."""


@dataclass(frozen=True, slots=True)
class Laser:
    """Settings of a laser scanner.

    Attributes:
        rays: number of rays.
        min_angle: direction of the first ray, in radians from straight ahead, counter-clockwise.
        field_of_view: angle between the first and the last ray, in radians. If it is a full turn, the rays
            are evenly spaced around the laser.
        range_min, range_max: range of measurements in metres.
        noise: standard deviation of a measurement in metres.
        no_echo: the range reported if a ray hits nothing between `range_min` and `range_max`.
        x, y, yaw: pose relative to the robot, in metres and radians.
        z: height above the robot's frame in metres. It changes nothing but the transform: costmaps ignore
            points below their `min_obstacle_height`.
        is_upside_down: whether the angles count clockwise, seen from above.
    """

    rays: int = 360
    min_angle: float = 0.0
    field_of_view: float = math.tau
    range_min: float = 0.12
    range_max: float = 10.0
    noise: float = 0.01
    no_echo: float = math.inf
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    z: float = 0.2
    is_upside_down: bool = False

    @property
    def increment(self) -> float:
        """The angle between neighbouring rays."""
        gaps = self.rays if self.field_of_view >= math.tau - 1e-9 else max(self.rays - 1, 1)
        return self.field_of_view / gaps

    @property
    def pose(self) -> Pose:
        """The laser's pose relative to the robot."""
        return Pose(self.x, self.y, self.yaw)


@dataclass(frozen=True, slots=True)
class Imu:
    """Settings of an inertial measurement unit, aligned with the robot.

    Attributes:
        yaw_noise, gyro_noise, acceleration_noise: standard deviations of the orientation in radians, of the
            angular velocities in rad/s, and of the accelerations in m/s².
        x, y, z: position relative to the robot in metres. Accelerations are those of the robot's centre.
    """

    yaw_noise: float = 0.005
    gyro_noise: float = 0.01
    acceleration_noise: float = 0.05
    x: float = 0.0
    y: float = 0.0
    z: float = 0.1


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """Settings of a robot: a disc, usually with two wheels on one axis through its centre.

    Attributes:
        name: unique name in the simulation; may be empty if there is only one robot.
        start: starting pose in the map frame; None selects a free place.
        radius: radius of the disc in metres.
        drive: how the robot moves, from `DRIVES`: `diff`; `omni`, also sideways; `ackermann`, a car that
            follows linear and angular velocities; `car`, as in Stage, for which the angular velocity of a
            command is the angle of the steering.
        wheelbase: distance between the axles of a car, in metres.
        min_turning_radius: least radius of a car's turns in metres; if 0, an `ackermann` drive steers up to
            `MAX_STEERING`.
        wheel_separation, wheel_radius: distance between the wheels and radius of a wheel, in metres.
        max_linear, max_angular: maximum velocities in m/s and rad/s.
        command_timeout_s: simulated time without a command after which the robot stops.
        odometry_noise: standard deviation of the odometry, as a fraction of the distance and of the turn in
            each step.
        wheel_slip: mean fraction of a wheel's rotation that does not move the robot, but is measured by the
            odometry. The fraction is random, separate for each wheel, and changes every second.
        odometry_error: maximum errors of the odometry, as fractions of the distance and of the turn. Stage
            draws the actual error once, between minus and plus half of the maximum.
        odometry_origin: pose of the odometry's frame in the map frame; None means the starting pose.
        is_odometry_exact: whether the odometry is always the true pose relative to `odometry_origin`.
        laser: the laser scanner, if any.
        imu: the inertial measurement unit, if any.
        battery: the battery and its load.
    """

    name: str = ""
    start: Pose | None = None
    radius: float = 0.15
    drive: str = "diff"
    wheelbase: float = 0.3
    min_turning_radius: float = 0.0
    wheel_separation: float = 0.24
    wheel_radius: float = 0.033
    max_linear: float = 0.5
    max_angular: float = 2.5
    command_timeout_s: float = 1.0
    odometry_noise: float = 0.0
    wheel_slip: float = 0.0
    odometry_error: tuple[float, float] = (0.0, 0.0)
    odometry_origin: Pose | None = None
    is_odometry_exact: bool = False
    laser: Laser | None = field(default_factory=Laser)
    imu: Imu | None = None
    battery: BatterySettings = field(default_factory=BatterySettings)

    @property
    def is_car(self) -> bool:
        """Whether the robot cannot turn on the spot."""
        return self.drive in ("ackermann", "car")

    @property
    def least_radius(self) -> float:
        """Least radius of a car's turns in metres; 0 if there is none."""
        usual = self.wheelbase / math.tan(MAX_STEERING) if self.drive == "ackermann" else 0.0
        return self.min_turning_radius or usual


_Settings = TypeVar("_Settings", Laser, Imu, BatterySettings, RobotSettings)

_MAY_BE_ZERO = {
    "command_timeout_s", "drive_a", "idle_a", "charge_a", "noise", "odometry_noise", "range_min",
    "wheel_slip", "yaw_noise", "gyro_noise", "acceleration_noise",
    "empty_v", "max_linear", "max_angular", "min_turning_radius",
}  # fmt: skip
_ANY_NUMBER = {"min_angle", "x", "y", "z", "yaw"}


def changed(defaults: _Settings, values: Any, where: str) -> _Settings:
    """Return the default settings, changed by the values in a mapping.

    Args:
        where: name of the mapping, for errors.

    Raises:
        InvalidSettings: a key is unknown, or a value is not a number in its range.
    """
    if not isinstance(values, dict):
        raise InvalidSettings(f"{where} must be a mapping, got {values!r}")
    usual = {each.name: getattr(defaults, each.name) for each in fields(defaults)}
    known = [name for name, value in usual.items() if type(value) in (int, float) or name == "drive"]
    checked: dict[str, Any] = {}
    for key, value in values.items():
        if key not in known:
            raise InvalidSettings(f"{where} has no setting {key!r}; the settings are {', '.join(known)}")
        if key == "drive":
            if value not in DRIVES:
                raise InvalidSettings(f"{where}/drive must be one of {', '.join(DRIVES)}, got {value!r}")
            checked[key] = value
        elif key == "rays":
            checked[key] = round(number(value, f"{where}/{key}"))
        else:
            checked[key] = _in_range(key, value, where)
    settings = replace(defaults, **checked)
    if isinstance(settings, Laser) and not 1 <= settings.rays <= MAX_RAYS:
        raise InvalidSettings(f"{where}/rays must be 1 to {MAX_RAYS}, got {settings.rays}")
    return settings


def number(value: object, where: str) -> float:
    """Return a value that must be a finite number. `where` is its name, for errors.

    Raises:
        InvalidSettings: the value is not a finite number.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InvalidSettings(f"{where} must be a finite number, got {value!r}")
    return float(value)


def boolean(value: object, where: str) -> bool:
    """Return a value that must be true or false. `where` is its name, for errors.

    Raises:
        InvalidSettings: the value is neither.
    """
    if not isinstance(value, bool):
        raise InvalidSettings(f"{where} must be true or false, got {value!r}")
    return value


def _in_range(key: str, value: object, where: str) -> float:
    if key == "no_echo" and value == math.inf:
        return math.inf
    checked = number(value, f"{where}/{key}")
    may_be_zero = key in (*_MAY_BE_ZERO, "no_echo")
    if key in _ANY_NUMBER or checked > 0 or (checked == 0 and may_be_zero):
        return checked
    raise InvalidSettings(f"{where}/{key} must be {'>=' if may_be_zero else '>'} 0, got {value!r}")
