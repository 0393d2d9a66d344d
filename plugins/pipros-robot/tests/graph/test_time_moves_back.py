"""After the time has moved back by an hour, every node publishes as often as before.

The nodes run in this process. Messages are given to their callbacks directly, and the tests set the time.
"""

import logging
import math
import threading
import time
from collections.abc import Callable
from typing import Any
from unittest.mock import Mock

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import Time
from pipros.node.clock import SimulatedClock
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.params import InvalidParameter
from pipros_libraries.nodes.schedule import Schedule
from pipros_robot.navigation.amcl import amcl_node
from pipros_robot.navigation.amcl.amcl_node import AmclNode
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.costmap.grid import FREE, UNKNOWN
from pipros_robot.navigation.costmap.layered import Pose2D
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
from tests.support.waiting import wait_until

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


@pytest.mark.parametrize(
    ("is_simulated", "text"), [(True, "~reset_on_time_jump is not set"), (False, "restart the filter")]
)
def test_a_filter_that_waits_says_what_to_do(
    make: Any, moment: Moment, caplog, is_simulated: bool, text: str
) -> None:
    node, work = make(odom0="odom", odom0_config=[True] * 3 + [False] * 12), Work()
    clock = SimulatedClock()
    node.clock = clock if is_simulated else node.clock
    FilterNode(node, LOG, work, unscented=False)  # type: ignore[arg-type]
    for _ in range(2):
        clock.set_ns(moment.ns)
        node.give("/odom", odometry())
        work.cycle()
        moment.advance(-HOUR_S)
    assert text in caplog.text


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


# Parameters that have no effect, or that ask for more than the robot or the machine can do, are named.


TRAPS = logging.getLogger("traps")
COSTMAP = {**PARAMETERS["move_base"]["local_costmap"], "global_frame": "odom", "transform_tolerance": 60.0}


@pytest.fixture
def make_trap(unlinked: Unlinked) -> Callable[..., UnlinkedNode]:
    return lambda **parameters: unlinked("move_base", parameters, log=TRAPS)


def costmap_of(node: UnlinkedNode) -> Costmap:
    frames = Frames(node, TRAPS)
    node.give("/tf", transforms("odom", BASE))
    return Costmap(node, TRAPS, frames, Work(), "local_costmap")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "expected"), [("/arm/outline", "/arm/outline"), ("outline", "/move_base/local_costmap/outline")]
)
def test_the_topics_of_footprints_may_be_absolute(make_trap: Any, given: str, expected: str) -> None:
    topics = {"footprint_topic": given, "published_footprint_topic": f"{given}_now"}
    node = make_trap(local_costmap={**COSTMAP, **topics})
    costmap = costmap_of(node)
    polygon = message("geometry_msgs/Polygon")
    point = message("geometry_msgs/Point32")
    polygon.points = [type(point)(x, y, 0.0) for x, y in ((2, 2), (2, -2), (-2, -2), (-2, 2))]
    node.give(expected, polygon)
    assert max(x for x, _ in costmap.footprint) > 2.0
    costmap.update()
    assert node.sent[f"{expected}_now"]


@pytest.mark.parametrize("name", ["origin_x", "origin_y", "footprint_padding"])
@pytest.mark.parametrize("value", [math.inf, -1e308])
def test_a_costmap_refuses_to_be_nowhere(make_trap: Any, caplog, name: str, value: float) -> None:
    costmap = costmap_of(make_trap(local_costmap=COSTMAP))
    costmap.update()
    before = costmap.footprint, costmap.grid.geometry
    costmap.settings.update({name: value})
    costmap.update()
    assert (costmap.footprint, costmap.grid.geometry) == before
    assert f"local_costmap: {name} must be from -1e+09 to 1e+09 m" in caplog.text


def test_a_scan_that_raises_an_error_does_so_once(make_trap: Any, monkeypatch) -> None:
    node = make_trap(local_costmap=COSTMAP)
    costmap_of(node)
    add = Mock(side_effect=[OverflowError("too far"), *[None] * 99])
    monkeypatch.setattr("pipros_robot.navigation.costmap.observations.ObservationSource.add", add)
    for _ in range(2):
        node.give("/tf", transforms("odom", BASE, ago_s=-1.0))  # a scan waits for one from after its end
    with pytest.raises(OverflowError):
        see(node)
    see(node)
    assert add.call_count == 2


def test_parameters_outside_of_their_planner_are_named(make_trap: Any, caplog) -> None:
    node = make_trap(
        default_tolerance=0.5, max_vel_x=0.3, controller_frequency=5.0,
        base_local_planner="dwa_local_planner/DWAPlannerROS", DWAPlannerROS={"max_vel_x": 0.4},
    )  # fmt: skip
    plugins.warn_of_names(node, TRAPS)
    assert "reads its parameters below ~NavfnROS: ~default_tolerance" in caplog.text
    assert "reads its parameters below ~DWAPlannerROS: ~max_vel_x\n" in caplog.text


@pytest.mark.parametrize(("own", "is_allowed"), [({}, False), ({"allow_unknown": True}, True)])
def test_navfn_has_the_topics_and_parameters_of_the_planner_that_it_replaces(
    make_trap: Any, caplog: pytest.LogCaptureFixture, own: dict[str, Any], is_allowed: bool
) -> None:
    caplog.set_level(logging.INFO)
    given = {"allow_unknown": False, "use_quadratic": True}
    node = make_trap(local_costmap=COSTMAP, GlobalPlanner=given, NavfnROS=own)
    costmap = costmap_of(node)
    costmap.grid.costs[...] = FREE
    costmap.grid.costs[:, costmap.grid.nearest_cell(1.5, 1.0)[0]] = UNKNOWN
    planner = plugins.global_planner(node, TRAPS, costmap, "global_planner/GlobalPlanner")
    assert (planner.make_plan(Pose2D(1, 1, 0), Pose2D(2, 1, 0)) is not None) == is_allowed
    assert node.sent["/move_base/GlobalPlanner/plan"]
    assert f"allow_unknown = {is_allowed}\n  not taken over: use_quadratic" in caplog.text


@pytest.mark.parametrize(
    ("frequency", "tolerance", "is_named"), [(5.0, 0.03, True), (5.0, 0.05, False), (20.0, 0.03, False)]
)
def test_a_tolerance_that_a_period_passes_is_named(
    make_trap: Any, caplog: pytest.LogCaptureFixture, frequency: float, tolerance: float, is_named: bool
) -> None:
    planner = "dwa_local_planner/DWAPlannerROS"
    limits = {"min_vel_theta": 0.4, "yaw_goal_tolerance": tolerance, "max_vel_x": 0.5, "max_vel_theta": 1.0}
    node = make_trap(controller_frequency=frequency, DWAPlannerROS=limits, local_costmap=COSTMAP)
    plugins.local_planner(node, TRAPS, costmap_of(node), planner, planner)
    assert ("yaw_goal_tolerance is 0.03, and the robot may not come to rest" in caplog.text) == is_named


@pytest.mark.parametrize(("planner", "namespace"), [
    ("dwa_local_planner/DWAPlannerROS", "DWAPlannerROS"),
    ("base_local_planner/TrajectoryPlannerROS", "TrajectoryPlannerROS"),
])  # fmt: skip
def test_names_that_sound_like_limits_are_named(make_trap: Any, caplog, planner: str, namespace: str) -> None:
    given = {"max_vel_x": 0.3, "max_vel_theta": 1.0, "max_vel_turn": 0.2, "max_speed": 0.1}
    node = make_trap(local_costmap=COSTMAP, **{namespace: given})
    plugins.local_planner(node, TRAPS, costmap_of(node), planner, planner)
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
def test_sources_that_see_nothing_are_refused(make_trap: Any, given: dict[str, Any], text: str) -> None:
    layer = {"observation_sources": "scan", "scan": {"data_type": "LaserScan"}, **given}
    node = make_trap(local_costmap={**COSTMAP, "obstacles": layer})
    with pytest.raises(InvalidParameter, match=f"~local_costmap/obstacles/{text}"):
        costmap_of(node)


def test_a_sensor_from_which_nothing_has_arrived_is_known(make_trap: Any) -> None:
    node = make_trap(local_costmap=COSTMAP)
    costmap = costmap_of(node)
    assert costmap.silent_topics == ["/scan"]
    node.give("/scan", scan())
    assert costmap.silent_topics == []


@pytest.mark.parametrize("is_set", [True, False])
def test_a_base_that_expects_angles_of_the_steering_is_named(make_trap: Any, caplog, is_set: bool) -> None:
    teb = {"cmd_angle_instead_rotvel": is_set, "min_turning_radius": 0.5, "max_vel_x": 0.3}
    node = make_trap(TebLocalPlannerROS=teb, local_costmap=COSTMAP)
    ours = "dwa_local_planner/DWAPlannerROS"
    plugins.local_planner(node, TRAPS, costmap_of(node), "teb_local_planner/TebLocalPlannerROS", ours)
    assert ("expects angles of the steering" in caplog.text) == is_set


@pytest.mark.parametrize(("taken_s", "is_late"), [(0.3, True), (0.0, False)])
def test_a_loop_that_misses_its_rate_says_so(make_trap: Any, caplog, taken_s: float, is_late: bool) -> None:
    node, calls = make_trap(), []
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
