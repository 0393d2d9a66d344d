"""laser_geometry and angles."""

# needs numpy
from __future__ import annotations

import math
from math import pi

import pytest
from sensor_msgs import point_cloud2
from sensor_msgs.msg import LaserScan, PointCloud2

import angles
from laser_geometry import LaserProjection

EVERYTHING = 0x1F


def scan(*ranges: float, intensities: tuple[float, ...] = ()) -> LaserScan:
    found = LaserScan(
        angle_min=0,
        angle_increment=pi / 2,
        time_increment=0.5,
        range_min=0.5,
        range_max=10,
        ranges=ranges,
        intensities=intensities,
    )
    found.header.frame_id = "laser"
    return found


def points(cloud: PointCloud2) -> list[tuple[float, ...]]:
    return [tuple(round(value, 5) for value in point) for point in point_cloud2.read_points(cloud)]


def test_ranges_within_the_limits_become_points() -> None:
    cloud = LaserProjection().projectLaser(scan(1, 2, 0.4, 10, math.nan, math.inf, 3))

    assert points(cloud) == [(1, 0, 0, 0), (0, 2, 0, 1), (-3, 0, 0, 6)]
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "index"]
    assert (cloud.header.frame_id, cloud.height, cloud.width, cloud.row_step) == ("laser", 1, 3, 48)


def test_a_point_has_the_requested_channels() -> None:
    cloud = LaserProjection().projectLaser(scan(1, 2, intensities=(7, 8)), 1.5, EVERYTHING)

    names = ["x", "y", "z", "intensity", "index", "distances", "stamps", "vp_x", "vp_y", "vp_z"]
    assert [field.name for field in cloud.fields] == names
    assert points(cloud) == [(1, 0, 0, 7, 0, 1, 0, 0, 0, 0)]
    plain = LaserProjection().projectLaser(scan(1), channel_options=LaserProjection.ChannelOption.NONE)
    assert [field.name for field in plain.fields] == ["x", "y", "z"]


def test_scans_of_another_shape_have_other_directions() -> None:
    projection, other = LaserProjection(), scan(1, 2)
    projection.projectLaser(scan(1, 2))
    other.angle_increment = pi

    assert points(projection.projectLaser(other))[1] == (-2, 0, 0, 1)


def test_an_empty_scan_is_an_empty_cloud() -> None:
    assert LaserProjection().projectLaser(scan()).width == 0


def test_missing_intensities_are_refused() -> None:
    with pytest.raises(IndexError, match="must have an intensity for each range, got 1 for 2"):
        LaserProjection().projectLaser(scan(1, 2, intensities=(7,)))


@pytest.mark.parametrize(("angle", "normal"), [(0, 0), (3 * pi, pi), (-pi, pi), (1.5 * pi, -0.5 * pi)])
def test_angles_are_normalized(angle: float, normal: float) -> None:
    assert angles.normalize_angle(angle) == normal
    assert angles.normalize_angle_positive(angle) == angle % (2 * pi)


def test_the_shortest_turn_crosses_the_seam() -> None:
    assert angles.shortest_angular_distance(3, -3) == pytest.approx(2 * pi - 6)
    assert angles.two_pi_complement(pi / 2) == -1.5 * pi
    assert angles.two_pi_complement(0) == 2 * pi
    assert angles.two_pi_complement(5 * pi) == -pi


def test_a_turn_keeps_the_limits_of_a_joint() -> None:
    within = angles.shortest_angular_distance_with_limits

    assert within(-0.5, 0.5, -1, 1) == (True, 1.0)
    assert within(-0.5, 0.5, 0.25, -0.25) == (True, 1.0 - 2 * pi)
    assert not within(-0.5, 0.5, -0.25, 0.25)[0]
    assert within(-0.5, 0.5, -pi, pi)[0]


def test_a_joint_may_turn_further_than_once() -> None:
    within = angles.shortest_angular_distance_with_large_limits

    assert within(0, 10.5 * pi, -2 * pi, 2 * pi) == (True, pytest.approx(0.5 * pi))
    assert within(0, 10.5 * pi, -2 * pi, 0.1 * pi) == (True, pytest.approx(-1.5 * pi))
    assert not within(10.5 * pi, 0, -2 * pi, 2 * pi)[0]
    assert not within(0, 1, 2, 1)[0]
    assert not within(0, 1, -0.5, 0.5)[0]


def test_nan_stays_nan() -> None:
    assert math.isnan(angles.normalize_angle(math.nan))
    assert math.isnan(angles.shortest_angular_distance_with_limits(math.nan, 0, -1, 1)[1])
