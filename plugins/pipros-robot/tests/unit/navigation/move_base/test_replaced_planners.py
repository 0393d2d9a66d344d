"""Limits of planners in C++ become limits of DWA."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.errors import NotFound
from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation.dwa.settings import DwaSettings
from pipros_robot.navigation.dwa.trajectories import simulated, window
from pipros_robot.navigation.move_base.limit_names import meaning, misunderstood
from pipros_robot.navigation.move_base.plugins import behind_adapter, take_over


class Params:
    """The parameters of a node, one dictionary for each namespace."""

    def __init__(self, values: Mapping[str, Mapping[str, Any]]) -> None:
        self.values = {name: dict(each) for name, each in values.items()}

    def get(self, name: str) -> Any:
        namespace, *path = name.split("/")
        found: Any = self.values
        for each in (namespace, *path):
            if not isinstance(found, dict) or each not in found:
                raise NotFound(name)
            found = found[each]
        return found

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


@pytest.mark.parametrize(("planner", "given", "name", "value"), [
    ("DWBLocalPlanner", {"max_speed_xy": 0.3}, "max_vel_x", 0.3),
    ("DWBLocalPlanner", {"vtheta_samples": 9}, "vth_samples", 9),
    ("EBandPlannerROS", {"max_vel_lin": 0.4, "max_vel_th": 0.7}, "max_vel_theta", 0.7),
    ("EBandPlannerROS", {"max_vel_lin": 0.4}, "max_vel_trans", 0.4),
])  # fmt: skip
def test_limits_have_other_names_in_other_planners(
    planner: str, given: dict[str, Any], name: str, value: float
) -> None:
    assert dwa_after(planner, given, {})[0][name] == value


def test_parameters_of_dwa_itself_come_first() -> None:
    found, left = dwa_after("TebLocalPlannerROS", {"max_vel_x": 0.2}, {"max_vel_x": 0.1})
    assert (found, left) == ({"max_vel_x": 0.1, **_WEIGHTS}, ["max_vel_x"])


def test_weights_of_the_user_are_kept_together() -> None:
    assert dwa_after("TebLocalPlannerROS", {}, {"occdist_scale": 0.5})[0] == {"occdist_scale": 0.5}


def test_a_robot_that_accelerates_slowly_can_start() -> None:
    given = {"max_vel_lin": 0.4, "max_acceleration": 0.2, "max_rotational_acceleration": 0.5}
    found = dwa_after("EBandPlannerROS", given, {})[0]
    settings = replace(DwaSettings(), sim_period=0.05, **found)

    velocities = simulated(settings, (0, 0, 0), (0, 0, 0), window(settings, (0, 0, 0), (0, 0, 0), (1, 0)))

    assert (velocities.commands[:, 0] > 0).any()
    assert (velocities.commands[:, 2] > 0).any()


@pytest.mark.parametrize(
    "loaded", ["dwb_local_planner::DWBLocalPlanner", "dwb_local_planner/DWBLocalPlanner"]
)
def test_limits_are_found_behind_an_adapter(loaded: str) -> None:
    params = Params(
        {"~LocalPlannerAdapter": {"planner_name": loaded}, "~DWBLocalPlanner": {"max_vel_x": 0.15}}
    )
    node: Any = SimpleNamespace(params=params)

    planner = behind_adapter(node, "nav_core_adapter::LocalPlannerAdapter")
    take_over(node, planner)

    assert (planner, params.values["~DWAPlannerROS"]["max_vel_x"]) == (loaded, 0.15)


def test_an_adapter_loads_dwb_unless_it_names_another() -> None:
    node: Any = SimpleNamespace(params=Params({}))
    found = behind_adapter(node, "nav_core_adapter::LocalPlannerAdapter")
    assert found == "dwb_local_planner::DWBLocalPlanner"
    assert behind_adapter(node, "neo_local_planner/NeoLocalPlanner") == "neo_local_planner/NeoLocalPlanner"


@pytest.mark.parametrize(("given", "name", "value"), [
    ({"max_rot_vel": 0.8}, "max_vel_theta", 0.8), ({"max_trans_vel": 0.15}, "max_vel_x", 0.15),
    ({"max_vel_x": 0.8, "max_trans_vel": 0.4}, "max_vel_trans", 0.4),
    ({"max_vel_trans": 0.9, "max_trans_vel": 0.4}, "max_vel_trans", 0.4),
    ({"max_vel_x_backwards": 0.1, "min_vel_x": -0.5}, "min_vel_x", -0.1),
    ({"acc_limit_theta": 0.6}, "acc_lim_theta", 0.6), ({"max_speed_theta": 0.7}, "max_vel_theta", 0.7),
    ({"max_rotation_vel": 0.7}, "max_vel_theta", 0.7), ({"max_speed": 0.2}, "max_vel_x", 0.2),
    ({"desired_linear_vel": 0.2}, "max_vel_trans", 0.2), ({"max_v": 0.2, "max_w": 0.5}, "max_vel_x", 0.2),
    ({"max_v": 0.2, "max_w": 0.5}, "max_vel_theta", 0.5), ({"MAX_SPEED": 0.2}, "max_vel_trans", 0.2),
    ({"maxAngularVelocity": 0.5}, "max_vel_theta", 0.5), ({"max_cmd_vel_ang": 0.5}, "max_vel_theta", 0.5),
    ({"v_limit": 0.2}, "max_vel_x", 0.2), ({"max_linear_accel": 0.3}, "acc_lim_x", 0.3),
    ({"limits": {"max_vel_x": 0.2}}, "max_vel_trans", 0.2),
    ({"robot": {"type": "a", "a": {"max_vel_x": 0.3}, "b": {"max_vel_x": 0.1}}}, "max_vel_x", 0.3),
    ({"car": {"wheelbase": 0.5, "max_steering_angle": math.atan(0.5)}}, "min_turning_radius", 1.0),
])  # fmt: skip
def test_old_names_of_limits_count_for_every_maker(given: dict[str, Any], name: str, value: float) -> None:
    assert dwa_after("NeoLocalPlanner", given, {})[0][name] == pytest.approx(value)


def test_names_that_sound_like_limits_are_noticed() -> None:
    _, left = dwa_after(
        "NeoLocalPlanner",
        {"vel_limit_of_crab": 1.0, "max_speed_arm": 2.0, "dt_ref": 0.3, "a": {"max_v_inc": 0.1}},
        {},
    )
    assert misunderstood([*left, "weight_max_vel_x"]) == ["a/max_v_inc", "max_speed_arm", "vel_limit_of_crab"]


@pytest.mark.parametrize("name", ["max_vel_2", "max_min_vel", "max_vel_x_y", "min_acc_x", "max_x", "vel_x"])
def test_names_with_other_words_are_no_limits(name: str) -> None:
    assert meaning(name) is None


@pytest.mark.parametrize("value", [math.nan, math.inf, -0.2, "0.2"])
def test_limits_of_other_makers_that_cannot_hold_are_refused_by_their_names(value: Any) -> None:
    with pytest.raises(InvalidParameter, match="~NeoLocalPlanner/a/max_trans_vel must be a"):
        dwa_after("NeoLocalPlanner", {"a": {"max_trans_vel": value}}, {})
