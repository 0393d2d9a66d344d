"""move_base of pipros beside the genuine one: results, interfaces, and the commands of the local planner."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

from pipros.libraries.transforms.pose import IDENTITY
from pipros.msg import load_message_class
from pipros.navigation.costmap.grid import CostGrid
from pipros.navigation.dwa.planner import DwaPlanner
from pipros.navigation.dwa.settings import SETTINGS, DwaSettings
from tests.support.both_bases import PARAMETERS, SIDES, BothBases, both_bases
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ANOTHER = "This goal was canceled because another goal was recieved by the simple action server"

FOOTPRINT = [(0.13, 0.11), (0.13, -0.11), (-0.13, -0.11), (-0.13, 0.11)]
"""That of `PARAMETERS`, with the padding."""


@pytest.fixture
def both(ros: RosSystem) -> Iterator[BothBases]:
    with both_bases(ros) as both:
        yield both


def reconfigure(both: BothBases, name: str, **values: float) -> None:
    """Change numbers of both, in the namespace `move_base` or one below."""
    config: Any = load_message_class("dynamic_reconfigure/Config")()
    number: Any = load_message_class("dynamic_reconfigure/DoubleParameter")
    config.doubles = [number(key, value) for key, value in values.items()]
    for side in SIDES:
        both.call(side, f"{name}set_parameters", "dynamic_reconfigure/Reconfigure", config)


def test_goals_end_with_the_same_statuses_and_texts(both: BothBases) -> None:
    def ends(*expected: tuple[int, str]) -> None:
        results = both.next_results(len(expected))
        assert results == {"pipros": list(expected), "genuine": list(expected)}

    both.velocity = (0.0, 0.0)
    both.send(0.0, 0.0)
    ends((3, "Goal reached."))
    both.send(2.0, 0.0)
    both.wait_until_active()
    both.send(2.0, 0.5)
    ends((2, ANOTHER))
    both.wait_until_active()
    both.cancel()
    ends((2, ""))
    both.send(1.1, 0.55)  # inside the block
    ends((4, "Failed to find a valid plan. Even after executing recovery behaviors."))
    both.send(1.0, 0.0, quaternion_w=0.0)
    ends((4, "Aborting on goal because it was sent with an invalid quaternion"))
    reconfigure(both, "", oscillation_timeout=1.0)
    both.send(2.0, 0.0)
    ends((4, "Robot is oscillating. Even after executing recovery behaviors."))
    reconfigure(both, "", oscillation_timeout=0.0, controller_patience=0.5)
    reconfigure(both, "DWAPlannerROS/", min_vel_trans=5.0, min_vel_theta=9.0)
    both.send(2.0, 0.0)
    ends((4, "Failed to find a valid control. Even after executing recovery behaviors."))


def test_services_parameters_topics_and_settings_are_the_same(both: BothBases) -> None:
    _compare_parameters(both)
    _compare_registrations(both)
    _compare_settings(both)
    _compare_plans(both)
    for side in SIDES:
        both.call(side, "clear_costmaps", "std_srvs/Empty")
        wait_until(partial(_has_the_far_wall, both, side), 30, f"the map of {side}")


def _has_the_far_wall(both: BothBases, side: str) -> bool:
    """Return whether the global costmap has a corner of the map, which no sensor reaches."""
    costs = both.latest(side, "move_base/global_costmap/costmap", "nav_msgs/OccupancyGrid")
    return bool(costs.data[0] == 100)


def _compare_plans(both: BothBases) -> None:
    pose: Any = load_message_class("geometry_msgs/PoseStamped")
    for x, y, tolerance in ((2.0, 0.5, 0.0), (1.1, 0.55, 0.0), (1.1, 0.55, 1.0)):
        goal = pose()
        goal.header.frame_id, goal.pose.orientation.w = "map", IDENTITY[6]
        goal.pose.position.x, goal.pose.position.y = x, y
        plans = {}
        for side in SIDES:
            plan = both.call(side, "make_plan", "nav_msgs/GetPlan", pose(), goal, tolerance).plan
            plans[side] = np.array([(each.pose.position.x, each.pose.position.y) for each in plan.poses])
        assert bool(len(plans["pipros"])) == bool(len(plans["genuine"])) == ((x, tolerance) != (1.1, 0.0))
        if len(plans["pipros"]):
            assert plans["pipros"][-1] == pytest.approx(plans["genuine"][-1])
            lengths = [np.hypot(*np.diff(plan, axis=0).T).sum() for plan in plans.values()]
            assert lengths[0] == pytest.approx(lengths[1], rel=0.05)


def _compare_parameters(both: BothBases) -> None:
    def parameters(side: str) -> dict[str, Any]:
        found: dict[str, Any] = {}

        def walk(values: dict[str, Any], prefix: str) -> None:
            for key, value in values.items():
                if isinstance(value, dict):
                    walk(value, f"{prefix}{key}/")
                else:
                    found[f"{prefix}{key}"] = value

        walk(both.node.params.get(f"/{side}/move_base"), "")
        return found

    wait_until(lambda: parameters("genuine").keys() == parameters("pipros").keys(), 20,
               lambda: str(parameters("genuine").keys() ^ parameters("pipros").keys()))  # fmt: skip
    ours, genuine = parameters("pipros"), parameters("genuine")
    assert {key: value for key, value in ours.items() if value != genuine[key]} == {}


def _compare_registrations(both: BothBases) -> None:
    publishers, subscribers, services = both.node.master.get_system_state()
    types = dict(both.node.master.get_topic_types())

    def named(table: list[Any], side: str, *, with_type: bool = True) -> set[tuple[str, str]]:
        prefix = f"/{side}"
        return {
            (name.removeprefix(prefix), types.get(name, "") if with_type else "")
            for name, nodes in table
            if f"{prefix}/move_base" in nodes and name not in ("/rosout", "/clock")
        }

    for table, with_type in ((publishers, True), (services, False)):
        assert named(table, "pipros", with_type=with_type) == named(table, "genuine", with_type=with_type)
    # genuine also subscribes to the footprints that it publishes itself, with a type that cannot match
    more = named(subscribers, "genuine") ^ named(subscribers, "pipros")
    assert {name.rpartition("/")[2] for name, _ in more} == {"footprint"}


def _compare_settings(both: BothBases) -> None:
    for name in ("", "DWAPlannerROS/"):
        kind = "dynamic_reconfigure/ConfigDescription"
        described = {
            side: both.latest(side, f"move_base/{name}parameter_descriptions", kind) for side in SIDES
        }
        fields = {
            side: [(each.name, each.type, each.level) for each in found.groups[0].parameters]
            for side, found in described.items()
        }
        assert fields["pipros"] == fields["genuine"]
        for part in ("dflt", "min", "max"):
            values = {side: _config(getattr(found, part)) for side, found in described.items()}
            assert values["pipros"] == values["genuine"]


def _config(message: Any) -> dict[str, Any]:
    lists = (message.bools, message.ints, message.strs, message.doubles)
    return {each.name: each.value for values in lists for each in values}


def test_the_local_planner_chooses_the_commands_of_the_genuine_one(both: BothBases) -> None:
    commands: list[Any] = []
    twist: Any = load_message_class("geometry_msgs/Twist")
    both.node.subscribe("/genuine/cmd_vel", twist, commands.append, queue_size=10)
    both.send(2.4, 0.9)
    for velocity in ((0.2, 0.1), (0.0, 0.0), (0.5, -0.6)):
        both.velocity = velocity
        commands.clear()
        wait_until(lambda: len(commands) > 5, what="commands for this velocity")
        _compare_choice(both, velocity, commands[-1])


def _compare_choice(both: BothBases, velocity: tuple[float, float], command: Any) -> None:
    """Check that the planner chooses the command for genuine's plan and costs, with the same score."""
    plan = both.latest("genuine", "move_base/DWAPlannerROS/global_plan", "nav_msgs/Path")
    tried = both.latest("genuine", "move_base/DWAPlannerROS/trajectory_cloud", "sensor_msgs/PointCloud2")
    names = _defaults()
    given = {name: value for name, value in PARAMETERS["DWAPlannerROS"].items() if name in names}
    planner = DwaPlanner(DwaSettings.of({**names, **given}, sim_period=0.1))
    points = [(each.pose.position.x, each.pose.position.y) for each in plan.poses]
    planner.look_at(_costmap_of_genuine(both), FOOTPRINT, (0.0, 0.0, 0.0), points)
    choice = planner.choose((0.0, 0.0, 0.0), (velocity[0], 0.0, velocity[1]))

    expected = (command.linear.x, command.linear.y, command.angular.z)
    assert choice.command == pytest.approx(expected, abs=1e-6)
    cloud = np.frombuffer(tried.data, np.float32).reshape(-1, tried.point_step // 4)
    legal = choice.scores[choice.scores >= 0]  # genuine stops to add up a score that exceeds the lowest one
    assert legal.min() == pytest.approx(cloud[:, 4].min(), abs=1e-3)


def _defaults() -> dict[str, Any]:
    return {each.name: each.default for each in SETTINGS}


def _costmap_of_genuine(both: BothBases) -> CostGrid:
    """Return the local costmap: exact where the robot may be, from the cloud of costs."""
    shown = both.latest("genuine", "move_base/local_costmap/costmap", "nav_msgs/OccupancyGrid")
    cloud = both.latest("genuine", "move_base/DWAPlannerROS/cost_cloud", "sensor_msgs/PointCloud2")
    grid = CostGrid()
    origin = shown.info.origin.position
    grid.resize(shown.info.width, shown.info.height, 0.05, origin.x, origin.y)
    values = np.array(shown.data, np.int16).reshape(grid.costs.shape)
    grid.costs[:] = np.select([values < 0, values == 100, values == 99], [255, 254, 253], 250)
    points = np.frombuffer(cloud.data, np.float32).reshape(-1, cloud.point_step // 4)
    columns, rows, inside = grid.world_to_cells(points[:, 0].astype(float), points[:, 1].astype(float))
    assert inside.all()
    grid.costs[rows, columns] = points[:, 5]
    return grid
