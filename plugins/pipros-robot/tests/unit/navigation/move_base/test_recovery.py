"""Recovery behaviours, and the names of planners and behaviours in parameters."""

from __future__ import annotations

import contextlib
import logging
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation.costmap.grid import FREE, LETHAL, UNKNOWN, CostGrid
from pipros_robot.navigation.costmap.layered import CellLayer, LayeredCostmap, Pose2D
from pipros_robot.navigation.move_base import plugins
from pipros_robot.navigation.move_base.recovery import ClearCostmap, Rotate, Tools
from pipros_robot.navigation.move_base.settings import SETTINGS
from pipros_robot.navigation.plane import Triple

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


def test_a_rotation_never_exceeds_the_limit_of_the_local_planner() -> None:
    driven: list[Triple] = []
    given, _, _ = tools(driven)
    rotate = Rotate(replace(given, fastest_turn=lambda: 0.3), "rotate_recovery")
    rotate.begin()
    rotate.recover()
    assert driven == [(0.0, 0.0, 0.3)]


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
        ("conservative_reset", ClearCostmap),
        ("rotate_recovery", Rotate),
        ("aggressive_reset", ClearCostmap),
        ("rotate_recovery", Rotate),
    ]
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
    with pytest.raises(
        InvalidParameter, match=r"and strict is set\. Set it to \[dwa_local_planner/DWAPlannerROS\]"
    ):
        plugins.check_planner(teb, plugins.LOCAL_PLANNERS, "base_local_planner", LOG, is_strict=True)


def test_a_car_is_never_rotated_in_place(caplog: pytest.LogCaptureFixture) -> None:
    driven: list[Triple] = []
    given, *_ = tools(driven)
    rotate = Rotate(replace(given, fastest_turn=lambda: 0.0), "rotate")
    rotate.begin()
    assert rotate.recover()
    assert driven == []
    assert "cannot turn in place" in caplog.text


@pytest.mark.parametrize(("given", "text"), [
    ({"max_vel_theta": math.nan}, "max_vel_theta must be a finite number, got nan"),
    (
        {"max_rotational_vel": -1},
        r"max_rotational_vel must be >= \S+/min_in_place_vel_theta \(0\), got -1",
    ),
    (
        {"min_in_place_rotational_vel": 2},
        r"max_vel_theta must be >= \S+/min_in_place_rotational_vel \(2\)",
    ),
    ({"acc_lim_th": 0}, "acc_lim_th must be > 0, got 0: the robot could not brake"),
])  # fmt: skip
def test_limits_of_a_rotation_that_cannot_hold_are_refused(given: dict[str, float], text: str) -> None:
    with pytest.raises(InvalidParameter, match=f"~TrajectoryPlannerROS/{text}"):
        Rotate(tools(TrajectoryPlannerROS=given)[0], "rotate")


@pytest.mark.parametrize("fastest", [0.2, 0])
def test_a_rotation_turns_within_its_limit_and_not_at_all_at_0(fastest: float) -> None:
    driven: list[Triple] = []
    rotate = Rotate(tools(driven, TrajectoryPlannerROS={"max_rotational_vel": fastest})[0], "rotate")
    rotate.begin()
    assert rotate.recover() == (not fastest)
    assert driven == ([(0.0, 0.0, fastest)] if fastest else [])
