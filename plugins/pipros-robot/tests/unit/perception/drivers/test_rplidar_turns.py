"""Scans of turns, computed by hand."""

from __future__ import annotations

from math import inf, pi, radians

import pytest

from pipros_robot.perception.drivers.rplidar.samples import Point
from pipros_robot.perception.drivers.rplidar.turns import cells_per_degree, sweep_of

TURN = [Point(90.0, 1000, 10), Point(0.0, 0, 0), Point(270.0, 3000, 30), Point(0.0, 0, 0)]
"""Valid points at 90 and 270 degrees; the others would be at 180 and 360."""


def test_a_scan_ends_with_the_first_and_last_valid_point() -> None:
    sweep = sweep_of(TURN, None, is_inverted=False)
    assert (sweep.angle_min, sweep.angle_max) == (pytest.approx(-pi / 2), pytest.approx(pi / 2))
    assert (sweep.ranges, sweep.intensities) == ([3.0, inf, 1.0], [30, 0, 10])
    inverted = sweep_of(TURN, None, is_inverted=True)
    assert (inverted.angle_min, inverted.ranges) == (sweep.angle_min, [1.0, inf, 3.0])


def test_points_fill_the_cells_up_to_the_next_degree() -> None:
    sweep = sweep_of([*TURN, Point(359.9, 5000, 1)], 1.5, is_inverted=True)
    assert (sweep.angle_min, sweep.angle_max) == (pytest.approx(-pi), pytest.approx(pi))
    assert len(sweep.ranges) == 540
    filled = {at: each for at, each in enumerate(sweep.ranges) if each < inf}
    assert filled == {135: 1.0, 136: 1.0, 405: 3.0, 406: 3.0, 539: 5.0}


def test_a_turn_without_valid_points_has_all_angles() -> None:
    sweep = sweep_of([Point(1.0, 0, 0)] * 3, 1.5, is_inverted=False)
    assert (sweep.angle_min, sweep.angle_max) == (pytest.approx(pi - radians(359)), pytest.approx(pi))
    assert (sweep.ranges, sweep.intensities) == ([inf] * 3, [0] * 3)


def test_the_number_of_cells_follows_the_rate() -> None:
    assert cells_per_degree(125.0, 10.0) == 800 / 360 + 1
    assert cells_per_degree(1e9, 10.0) == 1.0
