"""Cases computed by hand; tests.golden.navigation.test_laser_as_genuine compares with the genuine node."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pipros_robot.perception.laser.cloud_to_scan import CloudToScan, InvalidScanSettings

FOUR = CloudToScan(min_height=-1.0, max_height=1.0, angle_min=-2.0, angle_max=2.0, angle_increment=1.0)


def ranges(one: CloudToScan, *points: tuple[float, float, float]) -> list[float]:
    return list(map(float, one.ranges(np.array(points, np.float32).reshape(-1, 3))))


def test_a_beam_has_the_nearest_point_between_the_heights() -> None:
    found = ranges(FOUR, (3, 1, 0), (2, 0.5, 0), (1, 0.1, 2), (-1, 0, 0), (0, -2, 0.5))
    assert found == [2.0, math.inf, pytest.approx(math.hypot(2, 0.5)), math.inf]


def test_points_at_height_0_are_dropped_by_default() -> None:
    one = CloudToScan()
    assert (one.beams(), set(ranges(one, (1, 0, 0)))) == (360, {math.inf})
    assert ranges(one, (1, 0, 1e-6))[180] == 1.0


def test_empty_beams_may_be_finite_and_invalid_points_do_not_count() -> None:
    one = CloudToScan(min_height=-1.0, range_max=5.0, range_min=1.0, use_inf=False, angle_increment=3.0)
    nan = math.nan
    assert ranges(one, (nan, 1, 0), (1, nan, 0), (1, 1, nan), (6, 0, 0), (0.5, 0, 0)) == [6.0, 6.0, 6.0]


@pytest.mark.parametrize("increment", [0.0, -0.1, 1e-9, math.nan])
def test_impossible_numbers_of_beams_are_errors(increment: float) -> None:
    with pytest.raises(InvalidScanSettings, match=r"must give 0 to 1000000 beams"):
        CloudToScan(angle_increment=increment).beams()
