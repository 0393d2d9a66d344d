"""Parameters that have no effect, or that ask for more than the robot or the machine can do, are named."""

import logging
import math
from collections.abc import Callable
from typing import Any

import pytest

from pipros.node.clock import SimulatedClock
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.nodes.schedule import Schedule
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.costmap.grid import FREE, UNKNOWN
from pipros_robot.navigation.costmap.layered import Pose2D
from pipros_robot.navigation.move_base import plugins
from pipros_robot.navigation.world_parameters import PARAMETERS
from tests.graph.unlinked import Unlinked
from tests.support.unlinked_node import BASE, UnlinkedNode, Work, message, scan, transforms
from tests.support.waiting import wait_until

LOG = logging.getLogger("traps")
COSTMAP = {**PARAMETERS["move_base"]["local_costmap"], "global_frame": "odom", "transform_tolerance": 60.0}


@pytest.fixture
def make(unlinked: Unlinked) -> Callable[..., UnlinkedNode]:
    return lambda **parameters: unlinked("move_base", parameters, log=LOG)


def costmap_of(node: UnlinkedNode) -> Costmap:
    frames = Frames(node, LOG)
    node.give("/tf", transforms("odom", BASE))
    return Costmap(node, LOG, frames, Work(), "local_costmap")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "expected"), [("/arm/outline", "/arm/outline"), ("outline", "/move_base/local_costmap/outline")]
)
def test_the_topics_of_footprints_may_be_absolute(make: Any, given: str, expected: str) -> None:
    topics = {"footprint_topic": given, "published_footprint_topic": f"{given}_now"}
    node = make(local_costmap={**COSTMAP, **topics})
    costmap = costmap_of(node)
    polygon = message("geometry_msgs/Polygon")
    point = message("geometry_msgs/Point32")
    polygon.points = [type(point)(x, y, 0.0) for x, y in ((2, 2), (2, -2), (-2, -2), (-2, 2))]
    node.give(expected, polygon)
    assert max(x for x, _ in costmap.footprint) > 2.0
    costmap.update()
    assert node.sent[f"{expected}_now"]


def test_parameters_outside_of_their_planner_are_named(make: Any, caplog: pytest.LogCaptureFixture) -> None:
    node = make(
        default_tolerance=0.5, max_vel_x=0.3, controller_frequency=5.0,
        base_local_planner="dwa_local_planner/DWAPlannerROS", DWAPlannerROS={"max_vel_x": 0.4},
    )  # fmt: skip
    plugins.warn_of_names(node, LOG)
    assert "reads its parameters below ~NavfnROS: ~default_tolerance" in caplog.text
    assert "reads its parameters below ~DWAPlannerROS: ~max_vel_x\n" in caplog.text


@pytest.mark.parametrize(("own", "is_allowed"), [({}, False), ({"allow_unknown": True}, True)])
def test_navfn_has_the_topics_and_parameters_of_the_planner_that_it_replaces(
    make: Any, caplog: pytest.LogCaptureFixture, own: dict[str, Any], is_allowed: bool
) -> None:
    caplog.set_level(logging.INFO)
    given = {"allow_unknown": False, "use_quadratic": True}
    node = make(local_costmap=COSTMAP, GlobalPlanner=given, NavfnROS=own)
    costmap = costmap_of(node)
    costmap.grid.costs[...] = FREE
    costmap.grid.costs[:, costmap.grid.nearest_cell(1.5, 1.0)[0]] = UNKNOWN
    planner = plugins.global_planner(node, LOG, costmap, "global_planner/GlobalPlanner")
    assert (planner.make_plan(Pose2D(1, 1, 0), Pose2D(2, 1, 0)) is not None) == is_allowed
    assert node.sent["/move_base/GlobalPlanner/plan"]
    assert f"allow_unknown = {is_allowed}\n  not taken over: use_quadratic" in caplog.text


@pytest.mark.parametrize(
    ("frequency", "tolerance", "is_named"), [(5.0, 0.03, True), (5.0, 0.05, False), (20.0, 0.03, False)]
)
def test_a_tolerance_that_a_period_passes_is_named(
    make: Any, caplog: pytest.LogCaptureFixture, frequency: float, tolerance: float, is_named: bool
) -> None:
    planner = "dwa_local_planner/DWAPlannerROS"
    limits = {"min_vel_theta": 0.4, "yaw_goal_tolerance": tolerance, "max_vel_x": 0.5, "max_vel_theta": 1.0}
    node = make(controller_frequency=frequency, DWAPlannerROS=limits, local_costmap=COSTMAP)
    plugins.local_planner(node, LOG, costmap_of(node), planner, planner)
    assert ("yaw_goal_tolerance is 0.03, and the robot may not come to rest" in caplog.text) == is_named


@pytest.mark.parametrize(("planner", "namespace"), [
    ("dwa_local_planner/DWAPlannerROS", "DWAPlannerROS"),
    ("base_local_planner/TrajectoryPlannerROS", "TrajectoryPlannerROS"),
])  # fmt: skip
def test_names_that_sound_like_limits_are_named(
    make: Any, caplog: pytest.LogCaptureFixture, planner: str, namespace: str
) -> None:
    given = {"max_vel_x": 0.3, "max_vel_theta": 1.0, "max_vel_turn": 0.2, "max_speed": 0.1}
    node = make(local_costmap=COSTMAP, **{namespace: given})
    plugins.local_planner(node, LOG, costmap_of(node), planner, planner)
    assert "these names are not understood: max_speed, max_vel_turn" in caplog.text


@pytest.mark.parametrize(("given", "text"), [
    ({"observation_sources": ["scan"]}, r"observation_sources must be a text with names.*got \['scan'\]"),
    (
        {"scan": {"data_type": "LaserScan", "expected_update_rate": -1}},
        "scan/expected_update_rate must be",
    ),
    (
        {"scan": {"data_type": "LaserScan", "observation_persistence": math.nan}},
        "scan/observation_persistence must be",
    ),
])  # fmt: skip
def test_sources_that_see_nothing_are_refused(make: Any, given: dict[str, Any], text: str) -> None:
    layer = {"observation_sources": "scan", "scan": {"data_type": "LaserScan"}, **given}
    node = make(local_costmap={**COSTMAP, "obstacles": layer})
    with pytest.raises(InvalidParameter, match=f"~local_costmap/obstacles/{text}"):
        costmap_of(node)


def test_a_sensor_from_which_nothing_has_arrived_is_known(make: Any) -> None:
    node = make(local_costmap=COSTMAP)
    costmap = costmap_of(node)
    assert costmap.silent_topics == ["/scan"]
    node.give("/scan", scan())
    assert costmap.silent_topics == []


@pytest.mark.parametrize("is_set", [True, False])
def test_a_base_that_expects_angles_of_the_steering_is_named(
    make: Any, caplog: pytest.LogCaptureFixture, is_set: bool
) -> None:
    teb = {"cmd_angle_instead_rotvel": is_set, "min_turning_radius": 0.5, "max_vel_x": 0.3}
    node = make(TebLocalPlannerROS=teb, local_costmap=COSTMAP)
    ours = "dwa_local_planner/DWAPlannerROS"
    plugins.local_planner(node, LOG, costmap_of(node), "teb_local_planner/TebLocalPlannerROS", ours)
    assert ("expects angles of the steering" in caplog.text) == is_set


@pytest.mark.parametrize(("taken_s", "is_late"), [(0.3, True), (0.0, False)])
def test_a_loop_that_misses_its_rate_says_so(
    make: Any, caplog: pytest.LogCaptureFixture, taken_s: float, is_late: bool
) -> None:
    node, calls = make(), []
    node.clock = clock = SimulatedClock()
    clock.set_ns(1)

    def work() -> None:
        calls.append(1)
        clock.set_ns(clock.now_ns() + round(taken_s * 1e9))

    Schedule(node).every(0.1, work, name="Control loop")
    for _ in range(3):
        count = len(calls)
        wait_until(lambda: clock.sleeper_count)
        clock.set_ns(clock.now_ns() + 100_000_000)
        wait_until(lambda count=count: len(calls) > count and clock.sleeper_count)
    text = "Control loop missed its desired rate of 10.0000Hz... the loop actually took 0.3000 seconds"
    assert caplog.text.count(text) == is_late
    assert ("missed" in caplog.text) == is_late
