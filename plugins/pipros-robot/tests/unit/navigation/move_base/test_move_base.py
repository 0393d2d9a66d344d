"""The states of a goal, with a robot that only notes what it is told."""

import contextlib
import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipros.basics.errors import NotFound
from pipros_libraries.actions.server_goal import GoalEvent
from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation.costmap.grid import FREE, LETHAL, UNKNOWN, CostGrid
from pipros_robot.navigation.costmap.layered import CellLayer, LayeredCostmap, Pose2D
from pipros_robot.navigation.dwa.settings import DwaSettings
from pipros_robot.navigation.dwa.trajectories import simulated, window
from pipros_robot.navigation.move_base import plugins
from pipros_robot.navigation.move_base.limit_names import meaning, misunderstood
from pipros_robot.navigation.move_base.machine import STILL, DrivingState, End, GoalMachine, Trigger
from pipros_robot.navigation.move_base.plugins import behind_adapter, take_over
from pipros_robot.navigation.move_base.recovery import ClearCostmap, Rotate, Tools
from pipros_robot.navigation.move_base.settings import SETTINGS, MoveBaseSettings
from pipros_robot.navigation.plane import Poses, Triple

PLAN: Any = np.zeros((3, 3))
DRIVE: Triple = (0.5, 0.0, 0.0)
AFTER_ALL = " Even after executing recovery behaviors."


class Robot:
    """A robot with two recovery behaviours, which take `recovery_cycles` cycles each."""

    def __init__(self) -> None:
        self.at: Triple = (0.0, 0.0, 0.0)
        self.sees = self.follows = True
        self.arrived = False
        self.next: Triple | None = DRIVE
        self.driven: list[Triple] = []
        self.recoveries: list[tuple[int, Trigger]] = []
        self.recovery_cycles = 1
        self._left = 0

    def pose(self) -> Triple | None:
        return self.at

    def can_see(self) -> bool:
        return self.sees

    def follow(self, _: Poses) -> bool:
        return self.follows

    def has_arrived(self) -> bool:
        return self.arrived

    def command(self) -> Triple | None:
        return self.next

    def drive(self, velocity: Triple) -> None:
        self.driven.append(velocity)

    def begin_recovery(self, index: int, trigger: Trigger) -> bool:
        if index > 1:
            return False
        self.recoveries.append((index, trigger))
        self._left = self.recovery_cycles
        return True

    def recover(self) -> bool:
        self._left -= 1
        return self._left <= 0


def machine(robot: Robot, **patience: Any) -> GoalMachine:
    made = GoalMachine(
        robot, MoveBaseSettings(**{"controller_patience": 3.0, "planner_patience": 5.0, **patience})
    )
    made.begin(100.0, replaces=False)
    return made


def run(made: GoalMachine, seconds: Sequence[int], plan: Any = None) -> End | None:
    """Plan (if wanted) and run a cycle at each second after the beginning; stop at the end of the goal."""
    for second in seconds:
        now_s = 100.0 + second
        if made.wants_plan:
            made.planned(plan, now_s)
        end = made.cycle(now_s)
        if end is not None:
            return end
    return None


def test_a_goal_is_planned_driven_and_reached() -> None:
    robot = Robot()
    made = machine(robot)
    assert (robot.driven, made.state, made.wants_plan) == ([STILL], DrivingState.PLANNING, True)

    assert run(made, [0, 1, 2], PLAN) is None
    assert (made.state, made.wants_plan, robot.driven[1:]) == (DrivingState.CONTROLLING, False, [DRIVE] * 3)

    robot.arrived = True
    assert run(made, [3]) == End(GoalEvent.SUCCEED, "Goal reached.")
    assert (robot.driven[-1], made.state, made.wants_plan) == (STILL, DrivingState.PLANNING, False)


def test_with_a_planner_frequency_planning_goes_on_and_failures_while_driving_do_not_matter() -> None:
    robot = Robot()
    made = machine(robot, planner_frequency=1.0)
    run(made, [0], PLAN)
    assert made.wants_plan
    run(made, range(1, 20), None)
    assert (made.state, robot.recoveries) == (DrivingState.CONTROLLING, [])


def test_without_a_plan_the_recoveries_run_in_turn_and_then_the_goal_is_aborted() -> None:
    robot = Robot()
    end = run(machine(robot), range(40))
    assert robot.recoveries == [(0, Trigger.PLANNING), (1, Trigger.PLANNING)]
    assert end == End(GoalEvent.ABORT, f"Failed to find a valid plan.{AFTER_ALL}")
    assert DRIVE not in robot.driven


@pytest.mark.parametrize(("retries", "recoveries"), [(2, 1), (-1, 0)])
def test_too_many_failures_begin_the_recovery_before_the_patience_ends(retries: int, recoveries: int) -> None:
    robot = Robot()
    run(machine(robot, max_planning_retries=retries), range(4))
    assert len(robot.recoveries) == recoveries


def test_a_plan_after_a_recovery_starts_again_with_the_first_behaviour() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, range(8))
    run(made, [8, 9], PLAN)
    assert made.state is DrivingState.CONTROLLING
    made.begin(110.0, replaces=True)
    run(made, range(10, 20))
    assert [index for index, _ in robot.recoveries] == [0, 0]


def test_without_a_command_the_robot_stops_plans_again_and_recovers_after_the_patience() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0], PLAN)
    robot.next = None
    run(made, [1, 2, 3], PLAN)
    assert (robot.driven[-3:], robot.recoveries) == ([STILL] * 3, [])
    end = run(made, range(4, 20), PLAN)
    assert [index for index, _ in robot.recoveries] == [0, 1]
    assert end == End(GoalEvent.ABORT, f"Failed to find a valid control.{AFTER_ALL}")


def test_a_command_after_a_recovery_starts_again_with_the_first_behaviour() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0], PLAN)
    for second in range(1, 30):
        robot.next = DRIVE if second % 7 == 0 else None
        assert run(made, [second], PLAN) is None
    assert {index for index, _ in robot.recoveries} == {0}


def test_a_robot_that_does_not_get_on_oscillates() -> None:
    robot = Robot()
    made = machine(robot, oscillation_timeout=4.0, oscillation_distance=0.5)
    run(made, range(4), PLAN)
    robot.at = (0.6, 0.0, 0.0)
    assert run(made, range(4, 8), PLAN) is None, "it moved"
    end = run(made, range(8, 40), PLAN)
    assert robot.recoveries == [(0, Trigger.OSCILLATION), (1, Trigger.OSCILLATION)]
    assert end == End(GoalEvent.ABORT, f"Robot is oscillating.{AFTER_ALL}")


def test_blind_robots_stop_and_refused_plans_abort() -> None:
    robot = Robot()
    made = machine(robot)
    robot.sees = False
    assert run(made, [0, 1], PLAN) is None
    assert robot.driven == [STILL] * 3
    robot.sees, robot.follows = True, False
    assert run(made, [2]) == End(GoalEvent.ABORT, "Failed to pass global plan to the controller.")


def test_a_long_recovery_is_finished_before_anything_else_and_may_be_switched_off() -> None:
    robot = Robot()
    robot.recovery_cycles = 3
    made = machine(robot)
    run(made, range(7))
    assert made.is_recovering
    run(made, [7, 8])
    assert not made.is_recovering
    assert made.state is DrivingState.PLANNING

    end = run(machine(Robot(), recovery_behavior_enabled=False), range(20))
    assert end is not None
    assert end.text == Trigger.PLANNING.value


def test_a_replaced_goal_does_not_stop_the_robot_and_a_stopped_one_does() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0, 1], PLAN)
    made.begin(102.0, replaces=True)
    assert (robot.driven[-1], made.state, made.wants_plan) == (DRIVE, DrivingState.CONTROLLING, True)
    made.stop()
    assert (robot.driven[-1], made.wants_plan) == (STILL, False)
    made.planned(PLAN, 103.0)
    assert made.state is DrivingState.PLANNING, "a plan that comes too late changes nothing"


def test_patience_begins_again_if_the_time_moves_back() -> None:
    robot = Robot()
    made = machine(robot)
    assert run(made, [1]) is None
    assert run(made, [-90, -86]) is None
    assert made.state is DrivingState.PLANNING
    assert run(made, [-84, -83]) is None
    assert robot.recoveries == [(0, Trigger.PLANNING)]


def test_goals_that_arrive_in_each_cycle_neither_silence_nor_blind_the_robot() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0], PLAN)
    for second in range(101, 120):
        made.begin(float(second), replaces=True)
        before = len(robot.driven)
        made.cycle(float(second))
        assert robot.driven[before:] == [DRIVE], "a command of the local planner, along the last plan"
    robot.arrived = True
    assert made.cycle(120.0) is None, "the robot is at a goal that was replaced"
    assert (robot.driven[-1], made.state) == (STILL, DrivingState.PLANNING)


def test_a_robot_stops_if_the_goal_that_replaces_another_has_no_plan() -> None:
    robot = Robot()
    made = machine(robot)
    run(made, [0], PLAN)
    made.begin(101.0, replaces=True)
    made.planned(None, 101.0)
    assert (robot.driven[-1], made.state) == (STILL, DrivingState.PLANNING)


# Recovery behaviours, and the names of planners and behaviours in parameters.


LOG = logging.getLogger("test")
VALUES = {each.name: each.default for each in SETTINGS} | {"circumscribed_radius": 0.46}


class Parameters:
    """The parameter server of a node, for `read_parameters`."""

    def __init__(self, **values: Any) -> None:
        self.values = values

    def get(self, name: str) -> Any:
        return self.values.get(name.lstrip("~"), {})

    def set(self, name: str, value: Any) -> None:
        self.values[name.lstrip("~")] = value


class Map:
    """A costmap of 4 x 4 m around the origin, with a layer called `obstacles`."""

    def __init__(self) -> None:
        self.layered = LayeredCostmap()
        self.layered.resize(80, 80, 0.05, -2.0, -2.0)
        layer = CellLayer("global_costmap/obstacles", self.layered, FREE)
        layer.match_size()
        layer.grid.costs[:] = LETHAL
        self.cells = layer.grid
        self.layered.layers.append(layer)  # type: ignore[arg-type]
        self.lock = contextlib.nullcontext()
        self.pose: Pose2D | None = Pose2D(0.5, 0.0, 0.0)
        self.footprint = [(0.2, 0.1), (0.2, -0.1), (-0.2, -0.1), (-0.2, 0.1)]
        self.updates = 0

    @property
    def grid(self) -> CostGrid:
        return self.layered.grid

    def robot_pose(self) -> Pose2D | None:
        return self.pose

    def update(self) -> bool:
        self.updates += 1
        return True


def tools(driven: list[Triple] | None = None, **parameters: Any) -> tuple[Tools, Map, Map]:
    node: Any = SimpleNamespace(params=Parameters(**parameters), resolve=lambda name: name)
    maps: Any = (Map(), Map())
    drive: Any = (driven if driven is not None else []).append
    return Tools(node, LOG, *maps, drive), *maps


def test_clearing_keeps_a_square_around_the_robot() -> None:
    given, global_map, local_map = tools(clear={"reset_distance": 1.0})
    assert ClearCostmap(given, "clear").recover()
    for each in (global_map, local_map):
        kept = np.argwhere(each.cells.costs == LETHAL)
        assert (kept.min(axis=0).tolist(), kept.max(axis=0).tolist()) == ([30, 40], [49, 59])
        assert (each.cells.costs == UNKNOWN).sum() == 80 * 80 - 400


def test_clearing_may_be_limited_to_one_map_inverted_and_shown_at_once() -> None:
    clear = {
        "reset_distance": 1.0, "affected_maps": "local", "invert_area_to_clear": True, "force_updating": True,
    }  # fmt: skip
    given, global_map, local_map = tools(clear=clear)
    assert ClearCostmap(given, "clear").recover()
    assert ((global_map.cells.costs == LETHAL).all(), global_map.updates) == (True, 0)
    assert ((local_map.cells.costs == UNKNOWN).sum(), local_map.updates) == (400, 1)


@pytest.mark.parametrize("layers", [{"layer_names": ["obstacle_layer"]}, {}])
def test_layers_of_other_names_are_not_cleared(layers: dict[str, Any]) -> None:
    given, global_map, _ = tools(clear=layers)
    ClearCostmap(given, "clear").recover()
    assert (global_map.cells.costs == UNKNOWN).any() == (not layers)


def test_the_robot_turns_once_around_to_the_left_and_slows_down_at_the_end() -> None:
    driven: list[Triple] = []
    given, _, local_map = tools(driven)
    rotate = Rotate(given, "rotate_recovery")
    rotate.begin()
    turned, cycles = 0.0, 0
    while not rotate.recover():
        turned += driven[-1][2] * 0.03
        local_map.pose = Pose2D(0.5, 0.0, math.remainder(turned, math.tau))
        cycles += 1
        assert cycles < 400
    assert (turned, max(driven)[2]) == (pytest.approx(math.tau, abs=0.11), 1.0)
    assert min(driven)[2] < 1.0


def test_a_robot_beside_an_obstacle_does_not_turn() -> None:
    driven: list[Triple] = []
    given, _, local_map = tools(driven)
    local_map.grid.costs[43, 50] = LETHAL  # 0.17 m to the left: only the corners would touch it
    rotate = Rotate(given, "rotate_recovery")
    rotate.begin()
    assert rotate.recover()
    local_map.pose = None
    rotate.begin()
    assert rotate.recover()
    assert driven == []


def test_the_default_behaviours_clear_and_turn() -> None:
    given, _, _ = tools()
    made = plugins.behaviours(None, VALUES, given, is_strict=True)
    assert [(name, type(each)) for name, each in made.values()] == [
        ("conservative_reset", ClearCostmap), ("rotate_recovery", Rotate), ("aggressive_reset", ClearCostmap),
        ("rotate_recovery", Rotate),
    ]  # fmt: skip
    assert given.node.params.get("~aggressive_reset/reset_distance") == pytest.approx(1.84)
    without = plugins.behaviours(None, {**VALUES, "clearing_rotation_allowed": False}, given, is_strict=True)
    assert len(without) == 2


@pytest.mark.parametrize("given", [
    5, [{"name": "a"}], ["a"],
    [{"name": "a", "type": "RotateRecovery"}, {"name": "a", "type": "RotateRecovery"}],
])  # fmt: skip
def test_a_faulty_list_is_replaced_by_the_default(given: Any, caplog: pytest.LogCaptureFixture) -> None:
    assert len(plugins.behaviours(given, VALUES, tools()[0], is_strict=False)) == 4
    assert "the default behaviours are used" in caplog.text


def test_behaviours_in_c_plus_plus_are_left_out_or_refused(caplog: pytest.LogCaptureFixture) -> None:
    listed = [
        {"name": "slow", "type": "move_slow_and_clear/MoveSlowAndClear"},
        {"name": "r", "type": "RotateRecovery"},
    ]
    made = plugins.behaviours(listed, VALUES, tools()[0], is_strict=False)
    assert [name for name, _ in made.values()] == ["r"]
    assert (
        "[move_slow_and_clear/MoveSlowAndClear] is a C++ plugin, which pipros cannot load: it is left out"
        in caplog.text
    )
    with pytest.raises(InvalidParameter, match=r"and strict is set\. Remove it"):
        plugins.behaviours(listed, VALUES, tools()[0], is_strict=True)


def test_other_planners_are_named_or_refused(caplog: pytest.LogCaptureFixture) -> None:
    teb = "teb_local_planner/TebLocalPlannerROS"
    for name in (*plugins.LOCAL_PLANNERS, "DWAPlannerROS", "dwa_local_planner::DWAPlannerROS", teb):
        plugins.check_planner(name, plugins.LOCAL_PLANNERS, "base_local_planner", LOG, is_strict=False)
    assert [record.getMessage() for record in caplog.records] == [
        *(
            f"base_local_planner: [{name}] is not the name of the plugin: write "
            "[dwa_local_planner/DWAPlannerROS]"
            for name in ("DWAPlannerROS", "dwa_local_planner::DWAPlannerROS")
        ),
        f"base_local_planner: [{teb}] is a C++ plugin, which pipros cannot load; "
        "[dwa_local_planner/DWAPlannerROS] runs instead, with the parameters ~DWAPlannerROS/…",
    ]
    advice = r"and strict is set\. Set it to \[dwa_local_planner/DWAPlannerROS\]"
    with pytest.raises(InvalidParameter, match=advice):
        plugins.check_planner(teb, plugins.LOCAL_PLANNERS, "base_local_planner", LOG, is_strict=True)


@pytest.mark.parametrize(("given", "text"), [
    ({"max_vel_theta": math.nan}, "max_vel_theta must be a finite number, got nan"),
    ({"max_rotational_vel": -1}, r"max_rotational_vel must be >= \S+/min_in_place_vel_theta \(0\), got -1"),
    ({"min_in_place_rotational_vel": 2}, r"max_vel_theta must be >= \S+/min_in_place_rotational_vel \(2\)"),
    ({"acc_lim_th": 0}, "acc_lim_th must be > 0, got 0: the robot could not brake"),
])  # fmt: skip
def test_limits_of_a_rotation_that_cannot_hold_are_refused(given: dict[str, float], text: str) -> None:
    with pytest.raises(InvalidParameter, match=f"~TrajectoryPlannerROS/{text}"):
        Rotate(tools(TrajectoryPlannerROS=given)[0], "rotate")


@pytest.mark.parametrize("fastest", [0.2, 0.0])
@pytest.mark.parametrize("is_of_planner", [False, True])
def test_a_rotation_turns_within_its_limits_and_a_car_not_at_all(
    fastest: float, is_of_planner: bool, caplog: pytest.LogCaptureFixture
) -> None:
    driven: list[Triple] = []
    own = {} if is_of_planner else {"max_rotational_vel": fastest}
    given, *_ = tools(driven, TrajectoryPlannerROS=own)
    rotate = Rotate(replace(given, fastest_turn=lambda: fastest) if is_of_planner else given, "rotate")
    rotate.begin()
    assert rotate.recover() == (not fastest)
    assert driven == ([(0.0, 0.0, fastest)] if fastest else [])
    assert ("cannot turn in place" in caplog.text) == (not fastest)


# Limits of planners in C++ become limits of DWA.


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
    ({"vx_max": 0.2}, "max_vel_x", 0.2), ({"wz_max": 0.5}, "max_vel_theta", 0.5),
    ({"max_omega": 0.5}, "max_vel_theta", 0.5), ({"vmax": 0.2}, "max_vel_x", 0.2),
    ({"max_vtheta": 0.5}, "max_vel_theta", 0.5), ({"max_turn_rate": 0.5}, "max_vel_theta", 0.5),
    ({"max_rotvel": 0.5}, "max_vel_theta", 0.5), ({"max_transvel": 0.2}, "max_vel_trans", 0.2),
    ({"max_yaw_rate": 0.5}, "max_vel_theta", 0.5), ({"max_yawrate": 0.5}, "max_vel_theta", 0.5),
    ({"max_linear": 0.2}, "max_vel_x", 0.2), ({"angular_max": 0.5}, "max_vel_theta", 0.5),
    ({"max_forward_vel": 0.2}, "max_vel_x", 0.2), ({"cruise_speed": 0.2}, "max_vel_trans", 0.2),
    ({"v_limit": 0.2}, "max_vel_x", 0.2), ({"max_linear_accel": 0.3}, "acc_lim_x", 0.3),
    ({"limits": {"max_vel_x": 0.2}}, "max_vel_trans", 0.2),
    ({"robot": {"type": "a", "a": {"max_vel_x": 0.3}, "b": {"max_vel_x": 0.1}}}, "max_vel_x", 0.3),
    ({"car": {"wheelbase": 0.5, "max_steering_angle": math.atan(0.5)}}, "min_turning_radius", 1.0),
])  # fmt: skip
def test_old_names_of_limits_count_for_every_maker(given: dict[str, Any], name: str, value: float) -> None:
    assert dwa_after("NeoLocalPlanner", given, {})[0][name] == pytest.approx(value)


def test_names_that_sound_like_limits_are_noticed() -> None:
    given = {"vel_limit_of_crab": 1.0, "max_speed_arm": 2.0, "dt_ref": 0.3, "a": {"max_v_inc": 0.1}}
    _, left = dwa_after("NeoLocalPlanner", given, {})
    assert misunderstood([*left, "weight_max_vel_x"]) == ["a/max_v_inc", "max_speed_arm", "vel_limit_of_crab"]
    words = ["lin_vel", "maxTurnRate", "max_angular_z", "max_rate_of_turn", "max_translation", "speed_fast"]
    others = ["max_jerk_yaw", "max_yaw_tolerance", "max_decel_x", "use_vel_scaling", "min_speed", "log_level"]
    assert misunderstood([*words, *others]) == words


@pytest.mark.parametrize("name", ["max_vel_2", "max_min_vel", "max_vel_x_y", "min_acc_x", "max_x", "vel_x"])
def test_names_with_other_words_are_no_limits(name: str) -> None:
    assert meaning(name) is None


@pytest.mark.parametrize("value", [math.nan, math.inf, -0.2, "0.2"])
def test_limits_of_other_makers_that_cannot_hold_are_refused_by_their_names(value: Any) -> None:
    with pytest.raises(InvalidParameter, match="~NeoLocalPlanner/a/max_trans_vel must be a"):
        dwa_after("NeoLocalPlanner", {"a": {"max_trans_vel": value}}, {})
