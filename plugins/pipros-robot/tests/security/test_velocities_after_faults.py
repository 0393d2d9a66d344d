"""Each program that commands velocities goes through a table of faults; see `tests.support.motion_table`."""

import logging
import math
import re
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation.dwa.dwa_node import DwaLocalPlanner
from tests.support.environments import import_path, source_files
from tests.support.motion_table import faults, problems, run, sweep
from tests.support.moving_programs import MOVE_BASE, PROGRAMS
from tests.support.ros import RosSystem
from tests.support.unlinked_node import UnlinkedNode

LIMIT = re.compile("(max|min)_vel|acc_lim")


@pytest.mark.parametrize(("name", "fault"), [(name, fault) for name in PROGRAMS for fault in faults(name)])
def test_no_fault_leaves_a_base_with_a_velocity_that_nobody_stands_behind(
    ros: RosSystem, name: str, fault: str
) -> None:
    ros.serve_master()
    program, happens = PROGRAMS[name], faults(name)[fault]
    assert not list(problems(program, run(program, happens.happens, ros.master_uri), happens))


@pytest.mark.parametrize("name", sorted(PROGRAMS.keys() - {"move_base"}))  # script/long motion has it
def test_no_value_of_a_parameter_leaves_a_base_driving(ros: RosSystem, name: str) -> None:
    ros.serve_master()
    assert not [(label, wrong) for label, wrong in sweep(name, ros.master_uri) if wrong]


@pytest.mark.parametrize(("given", "text"), [
    ({"min_vel_theta": 0.6, "max_vel_theta": 0.5}, r"max_vel_theta must be >= min_vel_theta \(0.6\)"),
    ({"min_rot_vel": 0.6, "max_rot_vel": 0.5}, r"max_vel_theta must be >= min_vel_theta \(0.6\)"),
    ({"min_vel_trans": 0.6, "max_vel_trans": 0.5}, r"max_vel_trans must be >= min_vel_trans \(0.6\)"),
    ({"min_trans_vel": 0.6, "max_trans_vel": 0.5}, r"max_vel_trans must be >= min_vel_trans \(0.6\)"),
    ({"max_vel_theta": -1.0}, "max_vel_theta must be a finite number >= 0, got -1"),
    ({"acc_lim_theta": -1.0}, "acc_lim_theta must be a finite number >= 0, got -1"),
    ({"max_rot_vel": math.nan}, "max_vel_theta must be a finite number, got nan"),
    ({"max_vel_x": "0.2"}, "max_vel_x must be a number, got '0.2'"),
    ({"max_rot_vel": [0.2]}, r"max_vel_theta must be a number, got \[0.2\]"),
    ({"acc_lim_x": 1e-4}, "acc_lim_x must be at least 0.00833, got 0.0001: the robot could not brake"),
])  # fmt: skip
def test_limits_of_a_planner_that_cannot_hold_are_refused(
    ros: RosSystem, given: dict[str, Any], text: str
) -> None:
    ros.serve_master()
    own = {name: value for name, value in MOVE_BASE["DWAPlannerROS"].items() if not LIMIT.match(name)}
    with pytest.raises(InvalidParameter, match=f"~DWAPlannerROS/{text}"):
        planner(ros.master_uri, {**own, "max_vel_x": 0.5, **given})


@pytest.mark.parametrize("name", ["max_vel_theta", "max_rot_vel", "max_vel_trans", "max_trans_vel"])
@pytest.mark.parametrize("greatest", [0.0, 0.05])
def test_a_file_with_a_greatest_velocity_below_the_usual_least_one_is_accepted(
    ros: RosSystem, name: str, greatest: float
) -> None:
    ros.serve_master()
    made = planner(ros.master_uri, {"max_vel_x": 0.5, name: greatest})
    index = 2 if name in ("max_vel_theta", "max_rot_vel") else 0
    assert (made.greatest()[index], abs(made.limited((9.0, 9.0, -9.0))[index])) == (greatest, greatest)


def planner(master_uri: str, given: dict[str, float]) -> DwaLocalPlanner:
    with UnlinkedNode("tested", environment=Environment(master_uri=master_uri)) as node:
        node.params.set("~DWAPlannerROS", given)
        costmap: Any = SimpleNamespace(global_frame="odom")
        return DwaLocalPlanner(node, logging.getLogger("planner"), costmap)


def test_the_table_has_every_program_with_an_output_for_velocities() -> None:
    users = {import_path(file) for file in source_files() if " VelocityOutput(" in file.read_text()}
    assert {each.run.partition(":")[0].replace(".", "/") + ".py" for each in PROGRAMS.values()} == {
        str(each) for each in users
    }
