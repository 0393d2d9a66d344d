"""Settings of robots from parameters."""

# needs numpy
from __future__ import annotations

import math

import pytest

from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.settings import Imu, Laser, RobotSettings, boolean, changed


def test_given_numbers_replace_the_defaults() -> None:
    laser = changed(Laser(), {"rays": 181, "min_angle": -1.57, "noise": 0}, "laser")

    assert (laser.rays, laser.min_angle, laser.noise, laser.range_max) == (181, -1.57, 0.0, 10.0)
    assert changed(Laser(), {"no_echo": math.inf}, "laser").no_echo == math.inf


def test_a_full_turn_has_as_many_gaps_as_rays() -> None:
    assert Laser(rays=360).increment == pytest.approx(math.radians(1))
    assert Laser(rays=181, field_of_view=math.pi).increment == pytest.approx(math.radians(1))
    assert Laser(rays=1, field_of_view=1.0).increment == 1.0


@pytest.mark.parametrize(("values", "why"), [
    (7, "robot must be a mapping, got 7"),
    ({"speed": 1}, "robot has no setting 'speed'; the settings are radius, drive, wheelbase, "),
    ({"name": "a"}, "robot has no setting 'name'"), ({"radius": 0}, "robot/radius must be > 0, got 0"),
    ({"max_linear": -1}, "robot/max_linear must be >= 0, got -1"),
    ({"drive": "car!"}, "robot/drive must be one of diff, omni, ackermann, car, got 'car!'"),
    ({"radius": True}, "robot/radius must be a finite number, got True"),
    ({"radius": math.nan}, "robot/radius must be a finite number, got nan"),
])  # fmt: skip
def test_invalid_settings_raise(values: object, why: str) -> None:
    with pytest.raises(InvalidSettings, match=why):
        changed(RobotSettings(), values, "robot")


@pytest.mark.parametrize("rays", [0, -3, 10_001])
def test_the_number_of_rays_is_limited(rays: int) -> None:
    with pytest.raises(InvalidSettings, match=r"rays must be"):
        changed(Laser(), {"rays": rays}, "laser")


def test_a_boolean_is_true_or_false() -> None:
    assert boolean(False, "publish_tf") is False
    with pytest.raises(InvalidSettings, match="publish_tf must be true or false, got 'no'"):
        boolean("no", "publish_tf")


def test_an_imu_may_be_without_noise() -> None:
    assert changed(Imu(), {"gyro_noise": 0, "z": -0.1}, "imu") == Imu(gyro_noise=0.0, z=-0.1)
    with pytest.raises(InvalidSettings, match="imu/yaw_noise must be >= 0"):
        changed(Imu(), {"yaw_noise": -1}, "imu")
    with pytest.raises(InvalidSettings, match="laser has no setting 'is_upside_down'"):
        changed(Laser(), {"is_upside_down": True}, "laser")
