"""Outlines of robots."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation.costmap.footprint import (
    as_text,
    circle,
    from_parameter,
    inscribed_radius,
    padded,
    placed,
)

BURGER = [(-0.105, -0.105), (-0.105, 0.105), (0.041, 0.105), (0.041, -0.105)]


def test_the_radii_of_a_burger_and_of_a_round_robot() -> None:
    assert inscribed_radius(padded(BURGER, 0.01)) == pytest.approx(0.051, abs=1e-4)
    assert inscribed_radius(circle(1.0)) == pytest.approx(math.cos(math.radians(11.25)))
    assert inscribed_radius([(1.0, 0.0), (2.0, 0.0)]) == math.inf


def test_a_coordinate_of_zero_is_not_padded() -> None:
    assert padded([(1.0, 0.0), (-1.0, -2.0)], 0.5) == [(1.5, 0.0), (-1.5, -2.5)]


def test_a_footprint_is_read_from_lists_and_texts() -> None:
    assert from_parameter([[1, 2], [3.5, 4], [5, 6]], "~footprint") == [(1, 2), (3.5, 4), (5, 6)]
    text = as_text(BURGER)
    assert text == "[[-0.105,-0.105],[-0.105,0.105],[0.041,0.105],[0.041,-0.105]]"
    read = from_parameter(f" {text} ", "~footprint")
    assert np.array_equal(read, np.float32(BURGER))
    assert read != BURGER  # corners have single precision, as in genuine costmaps


@pytest.mark.parametrize("value", [
    "", "[", "[[1, 2], [3, 4]]", "[[1, 2], [3, 4], [5]]", "[[1, 2], [3, 4], ['a', 1]]", 7, None,
    [[1, 2]] * 2000, "[" * 5000, [[1, 2], [3, 4], [math.nan, 1]], [[1, 2], [3, 4], [True, 1]],
    "__import__('os')", [[1e300, 2], [3, 4], [5, 6]],
])  # fmt: skip
def test_other_values_are_refused(value: Any) -> None:
    with pytest.raises(
        InvalidParameter, match=r"~footprint must (be a list of 3 to 1000 corners|have coordinates below)"
    ):
        from_parameter(value, "~footprint")


def test_a_footprint_turns_with_the_robot() -> None:
    ((x, y),) = placed([(1.0, 0.0)], 2.0, 3.0, math.pi / 2)
    assert (x, y) == pytest.approx((2.0, 4.0))
