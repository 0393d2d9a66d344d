"""Limits of a simulated diff_drive_controller."""

# needs numpy
from __future__ import annotations

import pytest

from pipros_simulation.robots.controllers import Limiter
from pipros_simulation.robots.errors import InvalidSettings


def test_velocities_and_accelerations_are_limited_only_if_that_is_switched_on() -> None:
    values = {"max_velocity": 1.0, "max_acceleration": 5.0, "min_acceleration": -10.0}
    on = {"has_velocity_limits": True, "has_acceleration_limits": True}

    assert Limiter.of(values, "linear/x").limited(9.0, 0.0) == 9.0
    limits = Limiter.of(values | on, "linear/x")
    assert limits.limited(9.0, 0.0) == pytest.approx(0.1)  # 5 m/s² for 0.02 s
    assert (limits.limited(9.0, 0.95), limits.limited(-9.0, -1.0)) == (1.0, -1.0)
    assert limits.limited(0.0, 0.5) == pytest.approx(0.3)


def test_a_limit_that_is_missing_is_named() -> None:
    with pytest.raises(InvalidSettings, match=r"linear/x/max_velocity must be a finite number"):
        Limiter.of({"has_velocity_limits": True}, "linear/x")
