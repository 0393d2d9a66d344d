"""Drives with the limits of other planners' files: the robot arrives, and never exceeds them."""

import contextlib
import logging
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.nodes.wiring import subscribe
from pipros_robot.navigation import world as navigation_world
from pipros_robot.navigation.move_base import plugins
from pipros_robot.navigation.world import NavigationWorld
from pipros_workspace.index import SHARED_PACKAGES
from tests.graph.unlinked import Unlinked
from tests.support.ros import RosSystem

APARTMENT = str(SHARED_PACKAGES / "pipros_sim" / "maps" / "apartment.yaml")
START, GOAL = (2.9, 1.0, 1.2), (7.8, 1.5, 0.0)
TRAJECTORY = "base_local_planner/TrajectoryPlannerROS"
SHAPES: dict[str, tuple[str, dict[str, Any], float, float]] = {
    "trajectory": (
        TRAJECTORY,
        {"TrajectoryPlannerROS": {
            "max_vel_x": 0.15, "max_rotational_vel": 1.0, "min_in_place_vel_theta": 0.4, "acc_lim_x": 1.0,
            "holonomic_robot": False, "xy_goal_tolerance": 0.1, "yaw_goal_tolerance": 0.15, "vx_samples": 6,
        }}, 0.15, 1.0,
    ),
    "teb": (
        "teb_local_planner/TebLocalPlannerROS",
        {"TebLocalPlannerROS": {
            "max_vel_x": 0.25, "max_vel_x_backwards": 0.1, "max_vel_theta": 0.8, "acc_lim_x": 0.5,
            "acc_lim_theta": 1.0, "xy_goal_tolerance": 0.2, "yaw_goal_tolerance": 0.2, "dt_ref": 0.3,
        }}, 0.25, 0.8,
    ),
    "no limits": (TRAJECTORY, {"TrajectoryPlannerROS": {"holonomic_robot": False,
                                                        "yaw_goal_tolerance": 0.15}}, 0.55, 1.0),
}  # fmt: skip


def drive(ros: RosSystem, shape: str, seed: int) -> tuple[float, float]:
    """Drive to the goal. Return the greatest speeds, along x and of turns."""
    planner, parameters, _, _ = SHAPES[shape]
    made = NavigationWorld(
        ros.master_uri, APARTMENT, start=START, seed=seed,
        parameters={"move_base": {"base_local_planner": planner, **parameters}},
    )  # fmt: skip
    speeds: list[tuple[float, float]] = []

    def take(message: Any) -> None:
        speeds.append((abs(message.linear.x), abs(message.angular.z)))

    subscribe(made.node, "cmd_vel", "geometry_msgs/Twist", take, 100)
    try:
        made.reaches(*GOAL, within_s=150, tolerance_m=0.35)
        print(shape, seed, *np.max(speeds, axis=0), made.time_s)
        return float(max(x for x, _ in speeds)), float(max(turn for _, turn in speeds))
    finally:
        made.close()


@pytest.mark.parametrize("shape", SHAPES)
def test_a_robot_arrives_and_never_exceeds_the_limits_in_its_file(
    ros: RosSystem, shape: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    ros.serve_master()
    without = {**navigation_world.PARAMETERS["move_base"]}
    del without["DWAPlannerROS"]
    monkeypatch.setattr(navigation_world, "PARAMETERS", {**navigation_world.PARAMETERS, "move_base": without})
    with caplog.at_level(logging.INFO):
        speed, turn = drive(ros, shape, 1)
    _, _, fastest, fastest_turn = SHAPES[shape]
    assert fastest / 2 < speed <= fastest + 1e-9
    assert turn <= fastest_turn + 1e-9
    assert f"at most {fastest:g} m/s forwards" in caplog.text
    assert ("no limit is set" in caplog.text) == (shape == "no limits")


@pytest.mark.parametrize(("planner", "namespace", "turn"), [
    ("base_local_planner/TrajectoryPlannerROS", "TrajectoryPlannerROS", "max_vel_theta"),
    ("base_local_planner/TrajectoryPlannerROS", "TrajectoryPlannerROS", "max_rotational_vel"),
    ("dwa_local_planner/DWAPlannerROS", "DWAPlannerROS", "max_rot_vel"),
    ("teb_local_planner/TebLocalPlannerROS", "TebLocalPlannerROS", "max_vel_theta"),
])  # fmt: skip
def test_limits_that_became_lower_hold_at_the_next_start(
    unlinked: Unlinked, planner: str, namespace: str, turn: str
) -> None:
    """The settings of a planner are written back to the master, as by dynamic_reconfigure."""
    costmap: Any = SimpleNamespace(global_frame="odom")
    known = plugins.LOCAL_PLANNERS
    for speed, rate in ((0.5, 0.9), (0.2, 0.3)):
        node = unlinked("move_base", {f"{namespace}/max_vel_x": speed, f"{namespace}/{turn}": rate})
        ours = planner if planner in known else next(iter(known))
        made = plugins.local_planner(node, logging.getLogger("quiet"), costmap, planner, ours)
        forwards, _, turning = made.greatest()
        node.shutdown()
        assert (forwards, turning) == (speed, rate)


@pytest.mark.parametrize(("planner", "given"), [
    ("teb_local_planner/TebLocalPlannerROS", {"max_vel_x": 0.2, "max_vel_theta": 0.3}),
    ("dwa_local_planner/DWAPlannerROS", {"max_vel_x": 0.2, "max_trans_vel": 0.2, "max_rot_vel": 0.3}),
])  # fmt: skip
def test_limits_hold_that_another_planner_or_another_name_had_before(
    unlinked: Unlinked, planner: str, given: dict[str, float]
) -> None:
    costmap: Any = SimpleNamespace(global_frame="odom")
    ours = "dwa_local_planner/DWAPlannerROS"
    limits = {
        "max_vel_x": 0.2, "max_vel_trans": 0.2, "max_vel_y": 0.0, "max_vel_theta": 0.3, "min_vel_y": 0.0,
    }  # fmt: skip
    for each, values in ((planner, given), (ours, limits)):
        node = unlinked("move_base", {})
        for old in given:
            with contextlib.suppress(LookupError):
                node.params.delete(f"~DWAPlannerROS/{old}")
        for name, value in values.items():
            node.params.set(f"~{plugins.namespace_of(each)}/{name}", value)
        made = plugins.local_planner(node, logging.getLogger("quiet"), costmap, each, ours)
        node.shutdown()
        assert made.greatest() == (0.2, 0.0, 0.3)
    assert made.limited((1.0, 1.0, 1.0)) == (0.2, 0.0, 0.3)


@pytest.mark.parametrize("name", ["DWAPlannerROS", "TrajectoryPlannerROS"])
@pytest.mark.parametrize(("limits", "named"), [
    ({"max_vel_x": float("nan")}, "max_vel_x must be a finite number, got nan"),
    ({"max_vel_x": float("inf")}, "max_vel_x must be a finite number, got inf"),
    ({"min_vel_x": 0.3, "max_vel_x": 0.2}, "max_vel_x must be >= min_vel_x (0.3), got 0.2"),
    ({"acc_lim_x": 0.0}, "acc_lim_x must be > 0, got 0"), ({"acc_lim_theta": -1.0}, "acc_lim_theta must be"),
])  # fmt: skip
def test_limits_that_cannot_hold_end_the_start_instead_of_leaving_the_defaults(
    unlinked: Unlinked, name: str, limits: dict[str, float], named: str
) -> None:
    costmap: Any = SimpleNamespace(global_frame="odom")
    planner = next(each for each in plugins.LOCAL_PLANNERS if each.endswith(name))
    node = unlinked("move_base", {f"{name}/{limit}": value for limit, value in limits.items()})

    with pytest.raises(InvalidParameter) as raised:
        plugins.local_planner(node, logging.getLogger("quiet"), costmap, planner, planner)

    node.shutdown()
    assert f"{name}/{named}" in str(raised.value)
