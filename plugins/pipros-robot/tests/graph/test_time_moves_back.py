"""After the time has moved back by an hour, every node publishes as often as before.

The nodes run in this process. Messages are given to their callbacks directly, and the tests set the time.
"""

import logging
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros.node.clock import SimulatedClock
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.schedule import Schedule
from pipros_robot.navigation.amcl import amcl_node
from pipros_robot.navigation.amcl.amcl_node import AmclNode
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.exploration.explore_node import ExploreNode
from pipros_robot.navigation.filter.filter_node import FilterNode
from pipros_robot.navigation.hector.hector_node import HectorNode
from pipros_robot.navigation.laser_matcher.laser_matcher_node import LaserMatcherNode
from pipros_robot.navigation.mapping import gmapping_node
from pipros_robot.navigation.mapping.gmapping_node import GmappingNode
from pipros_robot.navigation.move_base import plugins
from pipros_robot.navigation.move_base.move_base_node import MoveBase
from pipros_robot.navigation.pose_ekf.pose_ekf_node import PoseEkfNode
from pipros_robot.navigation.world_parameters import PARAMETERS
from pipros_robot.perception.imu.nodes import MadgwickNode
from tests.graph.unlinked import Unlinked
from tests.support.unlinked_node import (
    BASE,
    UnlinkedNode,
    Work,
    imu,
    message,
    occupancy,
    odometry,
    posed,
    scan,
    transforms,
)

LOG = logging.getLogger("time_moves_back")
PERIOD_S, PERIODS, HOUR_S = 0.5, 8, 3600.0

Step = Callable[[], object]
"""Gives a node the messages of half a second, and does its periodic work."""


class Moment:
    """The time of this process, in nanoseconds."""

    def __init__(self) -> None:
        self.ns = round(2 * HOUR_S * 1e9)

    def advance(self, seconds: float) -> None:
        self.ns += round(seconds * 1e9)


@pytest.fixture
def moment(monkeypatch: pytest.MonkeyPatch) -> Moment:
    made = Moment()
    monkeypatch.setattr(time, "time_ns", lambda: made.ns)
    return made


@pytest.fixture
def make(unlinked: Unlinked, moment: Moment, monkeypatch: pytest.MonkeyPatch) -> Callable[..., UnlinkedNode]:
    for module in (amcl_node, gmapping_node):  # transforms that are not there will not arrive
        monkeypatch.setattr(module, "TRANSFORM_S", 0.0)
    return lambda **parameters: unlinked("tested", parameters)


def see(node: UnlinkedNode, x: float = 0.0) -> None:
    """Give a node a scan, and transforms from before and after it."""
    measured = scan()
    node.give("/tf", transforms("odom", BASE, x, ago_s=0.1))
    node.give("/tf", transforms("odom", BASE, x))
    node.give("/scan", measured)


def amcl(make: Any) -> tuple[list[Any], Step]:
    """Return the saved poses."""
    given = {"use_map_topic": True, "max_particles": 300, "save_pose_rate": 1.0}
    node, saved = make(**{**PARAMETERS["amcl"], **given}), []
    AmclNode(node, LOG, Work())  # type: ignore[arg-type]
    node.params.set = lambda name, value: saved.append(name)
    node.give("/tf_static", transforms(BASE, "laser"))
    node.give("/map", occupancy())
    return saved, lambda: see(node)


def gmapping(make: Any) -> tuple[list[Any], Step]:
    """Return the maps. Scans are only processed because of the time, as the robot stands still."""
    sides = {"xmin": -3.0, "xmax": 3.0, "ymin": -3.0, "ymax": 3.0, "delta": 0.1, "maxUrange": 4.0}
    node = make(base_frame=BASE, particles=2, temporalUpdate=0.7, map_update_interval=0.9, **sides)
    GmappingNode(node, LOG, Work())  # type: ignore[arg-type]
    return node.sent["/map"], lambda: see(node)


def hector(make: Any) -> tuple[list[Any], Step]:
    node, work = make(base_frame=BASE, odom_frame=BASE, map_size=400, map_resolution=0.05), Work()
    HectorNode(node, LOG, work)  # type: ignore[arg-type]
    return node.sent["/slam_out_pose"], lambda: see(node)


def matcher(make: Any) -> tuple[list[Any], Step]:
    node = make(base_frame=BASE)
    LaserMatcherNode(node, LOG, None)  # type: ignore[arg-type]
    return node.sent["/pose2D"], lambda: see(node)


def costmap(make: Any) -> tuple[list[Any], Step]:
    given = {**PARAMETERS["move_base"]["local_costmap"], "global_frame": "odom", "publish_frequency": 1.0}
    node, work = make(costmap={**given, "always_send_full_costmap": True}), Work()
    frames = Frames(node, LOG)
    node.give("/tf", transforms("odom", BASE))
    Costmap(node, LOG, frames, work, "costmap")  # type: ignore[arg-type]

    def step() -> None:
        see(node)
        work.cycle()

    return node.sent["/tested/costmap/costmap"], step


def move_base(make: Any) -> tuple[list[Any], Step]:
    """Return the plans during a drive."""
    size = {"global_frame": "odom", "width": 4, "height": 4}
    whole = {**PARAMETERS["move_base"]["local_costmap"], **size}
    node, work = (
        make(**{**PARAMETERS["move_base"], "global_costmap": whole, "planner_frequency": 1.0}),
        Work(),
    )
    listen = node.subscribe

    def subscribe(name: str, kind: Any, callback: Any, **options: Any) -> Any:
        found = listen(name, kind, callback, **options)
        if name == "/tf":  # the costmaps wait for the first transform
            callback(transforms("odom", BASE))
        return found

    node.subscribe = subscribe
    MoveBase(node, LOG, work)  # type: ignore[arg-type]
    see(node)
    goal = message("geometry_msgs/PoseStamped", "odom")
    goal.pose.position.x, goal.pose.orientation.w = 0.5, 1.0
    node.give("/move_base_simple/goal", goal)

    def step() -> None:
        node.give("/odom", odometry(0.0))
        see(node)
        work.cycle()

    return node.sent["/tested/NavfnROS/plan"], step


def ekf(make: Any) -> tuple[list[Any], Step]:
    used = [True] * 3 + [False] * 12
    node, work = make(odom0="odom", odom0_config=used, reset_on_time_jump=True), Work()
    node.clock = SimulatedClock()
    node.clock.set_ns(time.time_ns())
    FilterNode(node, LOG, work, unscented=False)  # type: ignore[arg-type]

    def step() -> None:
        node.clock.set_ns(time.time_ns())
        node.give("/odom", odometry())
        work.cycle()

    node.give("/set_pose", posed("odom"))
    return node.sent["/odometry/filtered"], step


def pose_ekf(make: Any) -> tuple[list[Any], Step]:
    node, work = make(vo_used=False, imu_used=False, sensor_timeout=1.0), Work()
    PoseEkfNode(node, LOG, work)  # type: ignore[arg-type]

    def step() -> None:
        node.give("/odom", odometry())
        work.cycle()

    return node.sent["/tested/odom_combined"], step


def madgwick(make: Any) -> tuple[list[Any], Step]:
    """Return the orientations. Messages wait for their magnetic fields if the time moves back."""
    node = make(publish_tf=False)
    MadgwickNode(node)
    field = message("sensor_msgs/MagneticField", "base_link")
    field.magnetic_field.x = 0.3
    for number in range(20):
        made = imu()
        made.header.stamp.nsecs += number
        node.give("/imu/data_raw", made)

    def step() -> None:
        made = imu()
        field.header.stamp = made.header.stamp
        node.give("/imu/data_raw", made)
        node.give("/imu/mag", field)

    return node.sent["/imu/data"], step


@pytest.mark.parametrize(
    "start", [amcl, gmapping, hector, matcher, costmap, move_base, ekf, pose_ekf, madgwick]
)
def test_a_node_publishes_as_often_as_before(make: Any, moment: Moment, start: Any) -> None:
    sent, step = start(make)
    counts = []
    for _ in range(2):
        before = len(sent)
        for _ in range(PERIODS):
            moment.advance(PERIOD_S)
            step()
        counts.append(len(sent) - before)
        moment.advance(-HOUR_S)
    assert counts[0] >= PERIODS // 4
    assert counts[1] >= counts[0] - 1


def test_a_goal_of_the_exploration_is_not_given_up(make: Any, moment: Moment) -> None:
    node, work = make(progress_timeout=10.0), Work()
    ExploreNode(node, LOG, work)  # type: ignore[arg-type]
    grid = occupancy()
    grid.data[40 * 80 + 40 : 40 * 80 + 60] = [-1] * 20
    node.give("/costmap", grid)
    for _ in range(2):
        for _ in range(PERIODS):
            moment.advance(PERIOD_S)
            node.give("/tf", transforms("map", "base_link"))
            work.cycle()
        moment.advance(-HOUR_S)
    assert len(node.sent["/move_base/goal"]) == 1
    moment.advance(HOUR_S)
    for _ in range(2):
        moment.advance(11.0)
        node.give("/tf", transforms("map", "base_link"))
        work.cycle()
    assert node.sent["/move_base/cancel"]


def test_a_filter_that_waits_names_the_parameter(
    make: Any, moment: Moment, caplog: pytest.LogCaptureFixture
) -> None:
    node, work = make(odom0="odom", odom0_config=[True] * 3 + [False] * 12), Work()
    node.clock = SimulatedClock()
    FilterNode(node, LOG, work, unscented=False)  # type: ignore[arg-type]
    for _ in range(2):
        node.clock.set_ns(moment.ns)
        node.give("/odom", odometry())
        work.cycle()
        moment.advance(-HOUR_S)
    assert "~reset_on_time_jump is not set" in caplog.text


def test_work_in_lockstep_goes_on(make: Any) -> None:
    node = make()
    node.params.set("/lockstep", [node.name])
    schedule, calls = Schedule(node), []
    schedule.every(0.1, lambda: calls.append(1))
    schedule.start()
    request: Any = load_service_class("pipros_sim/Advance")._request_class()
    for begin_s in (1000, 10):
        calls.clear()
        for step in range(11):
            request.now = Time(begin_s, step * 50_000_000)
            node.services["~advance"](request)
        assert len(calls) == 5


def test_commands_go_on_while_move_base_makes_another_local_planner(
    make: Any, moment: Moment, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = make()
    _, step = move_base(lambda **parameters: _configured(made, parameters))
    begun, may_end, usual = threading.Event(), threading.Event(), plugins.local_planner

    def slow(*arguments: Any) -> Any:
        begun.set()
        may_end.wait(30)
        return usual(*arguments)

    monkeypatch.setattr(plugins, "local_planner", slow)
    request: Any = load_service_class("dynamic_reconfigure/Reconfigure")._request_class()
    setting: Any = load_message_class("dynamic_reconfigure/StrParameter")
    request.config.strs = [setting("base_local_planner", "base_local_planner/TrajectoryPlannerROS")]
    change = threading.Thread(target=made.services["~set_parameters"], args=(request,))
    change.start()
    begun.wait(30)
    for _ in range(3):
        before = len(made.sent["/cmd_vel"])
        moment.advance(PERIOD_S)
        cycle = threading.Thread(target=step)
        cycle.start()
        cycle.join(20)
        assert len(made.sent["/cmd_vel"]) > before
    may_end.set()
    change.join()


def _configured(node: UnlinkedNode, parameters: dict[str, Any]) -> UnlinkedNode:
    for key, value in parameters.items():
        node.params.set(f"~{key}", value)
    return node
