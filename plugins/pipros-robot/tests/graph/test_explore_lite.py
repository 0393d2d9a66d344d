"""The node `explore` of explore_lite: a robot that knows nothing of an apartment sees all of it."""

import logging
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.actions.status import Status
from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation import plane
from pipros_robot.navigation.costmap.grid import FREE, UNKNOWN, CostGrid
from pipros_robot.navigation.exploration.explore_node import ExploreNode
from pipros_robot.navigation.exploration.frontiers import frontiers
from pipros_robot.navigation.mapping.settings import MappingSettings
from pipros_robot.navigation.mapping.survey import Survey, TrajectoryStep
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.settings import Laser, RobotSettings
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.world import World
from tests.graph.unlinked import Unlinked
from tests.support import drives
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.unlinked_node import Cycles, UnlinkedNode, endures, message, now
from tests.support.waiting import wait_until

LOG = logging.getLogger("explore")
LOG.setLevel(logging.CRITICAL + 1)
GOALS, MARKERS = "/move_base/goal", "/explore/frontiers"


@pytest.fixture
def make(unlinked: Unlinked) -> Callable[..., tuple[UnlinkedNode, Cycles]]:
    def made(**parameters: Any) -> tuple[UnlinkedNode, Cycles]:
        node, cycles = unlinked("explore", parameters), Cycles()
        ExploreNode(node, LOG, cycles)  # type: ignore[arg-type]
        return node, cycles

    return made


def a_map(values: Any, resolution: float = 0.5) -> Any:
    made = message("nav_msgs/OccupancyGrid", "map")
    made.info.height, made.info.width = np.shape(values)
    made.info.resolution, made.info.origin.orientation.w = resolution, 1.0
    made.data = np.ravel(values).tolist()
    return made


def end(node: UnlinkedNode, status: int) -> None:
    result = message("move_base_msgs/MoveBaseActionResult")
    result.status.goal_id.id, result.status.status = node.sent[GOALS][-1].goal_id.id, status
    node.give("/move_base/result", result)


def place(node: UnlinkedNode, x: float, y: float) -> None:
    node.give("/tf", plane.transforms("map", "base_link", plane.raised((x, y, 0.0)), now()))


def goal(node: UnlinkedNode) -> tuple[float, float]:
    position = node.sent[GOALS][-1].goal.target_pose.pose.position
    return position.x, position.y


def a_room(doors: int = 2) -> Any:
    """Return a free room with unknown cells behind its doors: 4 cells at the left, 8 at the right."""
    values = np.full((12, 20), 100)
    values[1:-1, 2:-2] = 0
    values[4:8, 1] = -1
    if doors == 2:
        values[2:10, -2] = -1
    return values


def test_the_longest_frontier_is_the_first_goal_and_the_next_follows_when_it_failed(make: Any) -> None:
    node, cycles = make(visualize=True)
    cycles.cycle()
    node.give("/costmap", a_map(a_room()))
    place(node, 2.0, 3.0)
    cycles.cycle()
    cycles.cycle()
    assert (len(node.sent[GOALS]), goal(node)) == (1, pytest.approx((9.25, 3.0)))
    assert node.sent[GOALS][-1].goal.target_pose.header.frame_id == "map"
    points, sphere, *_ = node.sent[MARKERS][-1].markers
    assert len(points.points) == 8
    assert (points.color.b, sphere.pose.position.x) == (1.0, 9.25)
    end(node, Status.ABORTED)
    assert goal(node) == pytest.approx((0.75, 3.0))
    node.give("/costmap", a_map(a_room(1)))
    cycles.cycle()
    assert [each.action for each in node.sent[MARKERS][-1].markers] == [0, 0, 2, 2]
    end(node, Status.ABORTED)
    cycles.cycle()
    assert len(node.sent[GOALS]) == 2


def test_a_goal_without_progress_is_given_up(make: Any) -> None:
    node, cycles = make(progress_timeout=0.0)
    node.give("/costmap", a_map(a_room()))
    place(node, 2.0, 3.0)
    cycles.cycle()
    wait_until(lambda: bool(cycles.cycle() or len(node.sent[GOALS]) == 2), 10)
    assert goal(node) == pytest.approx((0.75, 3.0))
    wait_until(lambda: bool(cycles.cycle() or node.sent["/move_base/cancel"]), 10)
    assert node.sent["/move_base/cancel"][0].id == node.sent[GOALS][1].goal_id.id


@pytest.mark.parametrize("name", ["progress_timeout", "planner_frequency", "gain_scale"])
def test_numbers_without_a_meaning_are_refused(make: Any, name: str) -> None:
    for value in (-1.0, math.nan) if name != "gain_scale" else (math.nan,):
        with pytest.raises(InvalidParameter, match=f"~{name} must be|scales finite"):
            make(**{name: value})


def test_an_update_of_the_map_ends_the_exploration_and_wrong_ones_are_dropped(make: Any) -> None:
    node, cycles = make()
    node.give("/costmap", a_map(a_room(1)))
    for x, height in ((1, 4), (19, 4), (1, 3)):
        place(node, 2.0, 3.0)
        update = message("map_msgs/OccupancyGridUpdate", "map", x=x, y=4, width=1, height=height)
        update.data = [100] * 4
        if (x, height) == (1, 4):
            cycles.cycle()
            assert len(node.sent[GOALS]) == 1
        else:
            node.give("/costmap_updates", update)
            cycles.cycle()
            assert not node.sent["/move_base/cancel"]
    node.give("/costmap_updates", message("map_msgs/OccupancyGridUpdate", x=1, y=4, width=1, height=4,
                                          data=[100] * 4))  # fmt: skip
    cycles.cycle()
    assert len(node.sent["/move_base/cancel"]) == 1


@pytest.mark.parametrize("topic", ["/costmap", "/costmap_updates", "/move_base/result"])
def test_edge_values_do_not_end_the_exploration(make: Any, topic: str) -> None:
    node, cycles = make()
    good = {
        "/costmap": lambda: a_map(a_room()),
        "/costmap_updates": lambda: message(
            "map_msgs/OccupancyGridUpdate", "map", x=1, y=4, width=1, height=4, data=[-1] * 4
        ),
        "/move_base/result": lambda: message("move_base_msgs/MoveBaseActionResult"),
    }

    def has_effect() -> bool:
        before = len(node.sent[GOALS])
        for values in (a_room(1), a_room(2)):
            node.give("/costmap", a_map(values))
            place(node, 2.0, 3.0)
            cycles.cycle()
        return len(node.sent[GOALS]) > before

    endures(node, topic, good[topic], has_effect)


def test_frontiers_behind_walls_and_short_ones_do_not_count() -> None:
    grid = CostGrid(UNKNOWN)
    grid.resize(30, 10, 0.1, 0.0, 0.0)
    grid.costs[2:8, 2:14] = grid.costs[2:8, 16:28] = FREE
    options = {"potential_scale": 1e-3, "gain_scale": 1.0}
    found = frontiers(grid, (0.5, 0.5), least_m=0.5, **options)
    assert [len(each.points) for each in found] == [36]
    assert found[0].cost == pytest.approx(1e-3 * found[0].distance - 3.6)
    assert found[0].centroid == pytest.approx((0.8, 0.5))
    assert not frontiers(grid, (0.5, 0.5), least_m=4.0, **options)
    grid.costs[:] = UNKNOWN
    assert not frontiers(grid, (0.5, 0.5), least_m=0.0, **options)


def test_an_apartment_is_seen_completely(make: Any) -> None:
    """A robot that reaches each goal, or the free place nearest to it, at once, sees all five rooms."""
    node, cycles = make(planner_frequency=1.0)
    world = World.from_cells(drives.apartment(), drives.RESOLUTION)
    laser = replace(Laser(), rays=360)
    simulation = Simulation(world, [RobotSettings(start=drives.START, laser=laser)], seed=1)
    size: Any = {"xmin": -1.0, "ymin": -1.0, "xmax": 11.0, "ymax": 9.0}
    settings = MappingSettings(maxUrange=3.0, maxRange=10.0, **size)
    survey = Survey(settings, laser.increment * np.arange(laser.rays))
    free, step, pose = world.free_cells(), None, drives.START
    for _ in range(60):
        simulation.place("", pose)
        step = TrajectoryStep((pose.x, pose.y, pose.yaw), np.array(simulation.scans([""])[""]), step)
        survey.follow(step)
        found = a_map(survey.values(), drives.RESOLUTION)
        found.info.origin.position.x, found.info.origin.position.y = survey.origin
        node.give("/costmap", found)
        place(node, pose.x, pose.y)
        goals = len(node.sent[GOALS])
        cycles.cycle()
        if len(node.sent[GOALS]) == goals:
            break
        x, y = goal(node)
        near = free[np.hypot(*(free - (x, y)).T).argsort()]
        pose = next(Pose(float(a), float(b), 0.0) for a, b in near if world.is_free(a, b, 0.2))
        node.give("/costmap", found)
    seen = drives.agreement(survey.values(), survey.origin, Pose(0.0, 0.0, 0.0))
    assert seen.free_iou > 0.95
    assert 5 < len(node.sent[GOALS]) < 60


def test_the_program_sends_a_goal_to_move_base(ros: RosSystem) -> None:
    ros.serve_master()
    process = ros.pipros.start("rosrun", "explore_lite", "explore", "_costmap_topic:=map")
    goals = Inbox()
    with Node("robot", environment=Environment(master_uri=ros.master_uri)) as robot:
        robot.subscribe("/move_base/goal", load_message_class("move_base_msgs/MoveBaseActionGoal"), goals)
        maps = robot.advertise("/map", load_message_class("nav_msgs/OccupancyGrid"), queue_size=1, latch=True)
        tf = robot.advertise("/tf", load_message_class("tf2_msgs/TFMessage"), queue_size=5)
        maps.publish(a_map(a_room()))
        wait_until_connected(tf)

        def has_goal() -> bool:
            tf.publish(plane.transforms("map", "base_link", plane.raised((2.0, 3.0, 0.0)), now()))
            return bool(goals.messages)

        wait_until(has_goal, 30)
    assert abs(goals.messages[0].goal.target_pose.pose.position.x - 9.25) < 0.01
    process.press_ctrl_c()
    assert process.wait() == 0
