"""Limits of planners in C++ become limits of DWA."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.errors import NotFound
from pipros.navigation.dwa.settings import DwaSettings
from pipros.navigation.dwa.trajectories import simulated, window
from pipros.navigation.move_base.replaced_planners import take_over


class Params:
    """The parameters of a node, one dictionary for each namespace."""

    def __init__(self, values: Mapping[str, Mapping[str, Any]]) -> None:
        self.values = {name: dict(each) for name, each in values.items()}

    def get(self, name: str) -> Any:
        if name not in self.values:
            raise NotFound(name)
        return self.values[name]

    def set(self, name: str, value: Any) -> None:
        namespace, _, last = name.rpartition("/")
        self.values.setdefault(namespace, {})[last] = value


_WEIGHTS = {"path_distance_bias": 32.0, "goal_distance_bias": 20.0, "occdist_scale": 0.02}


def dwa_after(planner: str, given: dict[str, Any], own: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    params = Params({f"~{planner}": given, "~DWAPlannerROS": own})
    node: Any = SimpleNamespace(params=params)
    _, left = take_over(node, f"package/{planner}")
    return params.values["~DWAPlannerROS"], left


def test_limits_of_teb_bound_every_default_of_dwa() -> None:
    given = {"max_vel_x": 0.2, "max_vel_x_backwards": 0.05, "max_vel_theta": 0.3, "dt_ref": 0.3}
    found, left = dwa_after("TebLocalPlannerROS", given, {})
    assert {name: round(value, 9) for name, value in found.items()} == {
        "max_vel_x": 0.2, "min_vel_x": -0.05, "max_vel_theta": 0.3, "max_vel_trans": 0.2, "max_vel_y": 0.0,
        "min_vel_y": 0.0, "min_vel_trans": 0.05, "min_vel_theta": 0.144, **_WEIGHTS,
    }  # fmt: skip
    assert left == ["dt_ref"]


@pytest.mark.parametrize(
    ("planner", "given", "name", "value"),
    [
        ("DWBLocalPlanner", {"max_speed_xy": 0.3}, "max_vel_x", 0.3),
        ("DWBLocalPlanner", {"vtheta_samples": 9}, "vth_samples", 9),
        ("EBandPlannerROS", {"max_vel_lin": 0.4, "max_vel_th": 0.7}, "max_vel_theta", 0.7),
        ("EBandPlannerROS", {"max_vel_lin": 0.4}, "max_vel_trans", 0.4),
    ],
)
def test_limits_have_other_names_in_other_planners(
    planner: str, given: dict[str, Any], name: str, value: float
) -> None:
    assert dwa_after(planner, given, {})[0][name] == value


def test_parameters_of_dwa_itself_come_first() -> None:
    found, left = dwa_after("TebLocalPlannerROS", {"max_vel_x": 0.2}, {"max_vel_x": 0.1})
    assert found == {"max_vel_x": 0.1, **_WEIGHTS}
    assert left == ["max_vel_x"]


def test_weights_of_the_user_are_kept_together() -> None:
    assert dwa_after("TebLocalPlannerROS", {}, {"occdist_scale": 0.5})[0] == {"occdist_scale": 0.5}


def test_a_robot_that_accelerates_slowly_can_start() -> None:
    given = {"max_vel_lin": 0.4, "max_acceleration": 0.2, "max_rotational_acceleration": 0.5}
    found = dwa_after("EBandPlannerROS", given, {})[0]
    settings = replace(DwaSettings(), sim_period=0.05, **found)

    velocities = simulated(settings, (0, 0, 0), (0, 0, 0), window(settings, (0, 0, 0), (0, 0, 0), (1, 0)))

    assert (velocities.commands[:, 0] > 0).any()
    assert (velocities.commands[:, 2] > 0).any()
