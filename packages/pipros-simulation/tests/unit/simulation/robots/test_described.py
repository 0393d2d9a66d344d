"""Poses of lasers in robot descriptions."""

# needs numpy
from __future__ import annotations

import math

import pytest

from pipros_libraries.robot_model.urdf import UrdfError
from pipros_simulation.robots.settings import Laser
from pipros_simulation.robots.sim_program import placed_laser

ROBOT = """
<robot name="r">
  <link name="base"/><link name="base_link"/><link name="mast"/><link name="laser"/>
  <joint name="a" type="fixed"><parent link="base"/><child link="base_link"/><origin xyz="0 0 9"/></joint>
  <joint name="b" type="revolute"><parent link="base_link"/><child link="mast"/><axis xyz="0 0 1"/>
    <origin xyz="0.1 0 0.2" rpy="0 0 1.5707963267948966"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="c" type="fixed"><parent link="mast"/><child link="laser"/>
    <origin xyz="0.3 0 0" rpy="ROLL 0 0"/></joint>
</robot>
"""


def test_a_laser_is_relative_to_the_closest_base() -> None:
    laser = placed_laser(Laser(rays=9), ROBOT.replace("ROLL", "0"), "laser", ("base", "base_link"))

    assert (laser.x, laser.y, laser.z) == pytest.approx((0.1, 0.3, 0.2))
    assert (laser.rays, laser.yaw, laser.is_upside_down) == (9, pytest.approx(math.pi / 2), False)


def test_a_laser_can_be_upside_down() -> None:
    laser = placed_laser(Laser(), ROBOT.replace("ROLL", "3.141592653589793"), "laser", ("base_link",))

    assert (abs(laser.yaw), laser.is_upside_down) == (pytest.approx(math.pi / 2), True)


def test_a_laser_that_is_not_described_stays_where_it_is() -> None:
    assert placed_laser(Laser(), ROBOT.replace("ROLL", "0"), "scan", ("base",)) == Laser()
    with pytest.raises(UrdfError):
        placed_laser(Laser(), "<robot", "laser", ("base",))
