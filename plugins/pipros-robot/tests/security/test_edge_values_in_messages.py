"""A message with an edge value in any field of any input leaves the effect of the good messages after it.

The nodes of navigation run in this process. Messages are given to their callbacks directly, and their
periodic work is called directly, so an exception in a callback or a cycle fails the test. So does one in a
service, unless it is the error that tells the caller why.
"""

import contextlib
import logging
from collections.abc import Callable
from copy import deepcopy
from functools import partial
from typing import Any

import numpy as np
import pytest

from pipros.basics.errors import Unreachable
from pipros.msg import load_service_class
from pipros.node.service_server import CallFailed
from pipros_libraries.nodes.frames import Frames
from pipros_robot.navigation.amcl import amcl_node
from pipros_robot.navigation.amcl.amcl_node import AmclNode
from pipros_robot.navigation.costmap.costmap import Costmap
from pipros_robot.navigation.costmap.grid import LETHAL
from pipros_robot.navigation.filter.filter_node import FilterNode
from pipros_robot.navigation.mapping import gmapping_node
from pipros_robot.navigation.mapping.gmapping_node import GmappingNode
from pipros_robot.navigation.move_base.move_base_node import MoveBase
from pipros_robot.navigation.navsat.navsat_node import NavsatNode
from pipros_robot.navigation.world_parameters import PARAMETERS
from tests.graph.unlinked import Unlinked
from tests.support.edge_values import edge_messages
from tests.support.unlinked_node import (
    BASE,
    Work,
    endures,
    finite,
    imu,
    message,
    now,
    occupancy,
    odometry,
    posed,
    scan,
    transforms,
    variances,
)

LOG = logging.getLogger("edge_values")
LOG.setLevel(logging.CRITICAL + 1)


@pytest.fixture
def make(unlinked: Unlinked, monkeypatch: pytest.MonkeyPatch) -> Unlinked:
    for module in (amcl_node, gmapping_node):  # transforms that are not there will not arrive
        monkeypatch.setattr(module, "TRANSFORM_S", 0.0)
    monkeypatch.setattr(amcl_node, "INITIAL_POSE_S", 0.0)
    return unlinked


def answering(node: Any, service: str) -> Callable[[Any], object]:
    """Return what calls a service of a node, whose only error may be the one that callers can understand."""

    def call(request: Any) -> None:
        with contextlib.suppress(CallFailed):
            node.services[service](request)

    return call


FILTER = {
    "frequency": 30.0, "sensor_timeout": 0.1, "use_control": True, "stamped_control": False,
    "odom0": "odom", "odom0_config": [True] * 3 + [False] * 3 + [True] * 3 + [False] * 6,
    "pose0": "pose", "pose0_config": [True] * 6 + [False] * 9, "pose0_differential": True,
    "pose1": "relative", "pose1_config": [False] * 5 + [True] + [False] * 9, "pose1_relative": True,
    "twist0": "twist", "twist0_config": [False] * 6 + [True] * 6 + [False] * 3,
    "imu0": "imu", "imu0_config": [False] * 3 + [True] * 3 + [False] * 3 + [True] * 6,
    "imu0_remove_gravitational_acceleration": True,
    "control_config": [True] * 6, "acceleration_limits": [1.0] * 6, "deceleration_limits": [1.0] * 6,
    "acceleration_gains": [1.0] * 6, "deceleration_gains": [1.0] * 6,
}  # fmt: skip


def twist_with_covariance() -> Any:
    made = message("geometry_msgs/TwistWithCovarianceStamped", "base_link")
    made.twist.covariance = variances(0.01)
    return made


FILTER_INPUTS: dict[str, Callable[[], Any]] = {
    "/odom": odometry, "/pose": partial(posed, "odom"), "/relative": partial(posed, "odom"),
    "/twist": twist_with_covariance, "/imu": imu, "/cmd_vel": partial(message, "geometry_msgs/Twist"),
    "/set_pose": partial(posed, "odom"),
}  # fmt: skip


@pytest.mark.parametrize("topic", FILTER_INPUTS)
@pytest.mark.parametrize("kind", ["ekf", "ukf"])
def test_a_filter_goes_on(make: Any, kind: str, topic: str) -> None:
    node, work = make("filter", FILTER), Work()
    with np.errstate(all="raise"):
        FilterNode(node, LOG, work, unscented=kind == "ukf")  # type: ignore[arg-type]
    estimates = node.sent["/odometry/filtered"]

    def has_effect() -> bool:
        before = len(estimates)
        for name, good in FILTER_INPUTS.items():
            if name not in ("/cmd_vel", "/set_pose"):
                node.give(name, good())
        work.cycle()
        return len(estimates) > before and finite(estimates[-1])

    endures(node, topic, FILTER_INPUTS[topic], has_effect)
    for _ in range(150):
        assert has_effect()
    place = estimates[-1].pose.pose.position
    assert (place.x, place.y, place.z) == pytest.approx((1.0, 0.0, 0.0), abs=0.2)


@pytest.mark.parametrize("topic", ["/scan", "/initialpose", "/map", "/tf", "set_map"])
def test_amcl_goes_on(make: Any, topic: str) -> None:
    parameters = {**PARAMETERS["amcl"], "use_map_topic": True, "max_particles": 300, "save_pose_rate": -1.0}
    node, work = make("amcl", parameters), Work()
    AmclNode(node, LOG, work)  # type: ignore[arg-type]
    set_map: Any = load_service_class("nav_msgs/SetMap")._request_class
    inputs = {"/scan": scan, "/initialpose": partial(posed, "map", 0.0), "/map": occupancy,
              "/tf": partial(transforms, "odom", BASE),
              "set_map": lambda: set_map(occupancy(), posed("map", 0.0))}  # fmt: skip
    node.inputs["set_map"] = [answering(node, "set_map")]
    places, frames = node.sent["/amcl_pose"], node.sent["/tf"]
    node.give("/tf_static", transforms(BASE, "laser"))
    x = 0.0

    def has_effect() -> bool:
        nonlocal x
        before, sent = len(places), len(frames)
        x = 0.25 - x
        node.give("/map", occupancy())
        node.give("/initialpose", posed("map", 0.0))
        for _ in range(2):
            node.give("/tf", transforms("odom", BASE, x))
            measured = scan()
            node.give("/tf", transforms("odom", BASE, x))
            node.give("/scan", measured)
        work.cycle()
        return len(places) > before and finite(places[-1]) and len(frames) > sent and finite(frames[-1])

    endures(node, topic, inputs[topic], has_effect)


def test_amcl_goes_on_without_a_master(make: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    parameters = {**PARAMETERS["amcl"], "use_map_topic": True, "max_particles": 300, "save_pose_rate": 1e6}
    node, work = make("amcl", parameters), Work()
    AmclNode(node, LOG, work)  # type: ignore[arg-type]
    saved = []

    def set_parameter(name: str, value: object) -> None:
        saved.append(name)
        raise Unreachable("master [http://gone]", "Connection refused")

    monkeypatch.setattr(node.params, "set", set_parameter)
    node.give("/tf_static", transforms(BASE, "laser"))
    node.give("/map", occupancy())
    node.give("/initialpose", posed("map", 0.0))
    for _ in range(4):
        measured = scan()
        node.give("/tf", transforms("odom", BASE))
        node.give("/scan", measured)
    assert "~initial_pose_x" in saved
    assert len(node.sent["/tf"]) > 2


def costmap_parameters() -> Any:
    return {**PARAMETERS["move_base"]["local_costmap"], "global_frame": "odom"}


@pytest.mark.parametrize("topic", ["/scan", "/tf"])
def test_a_costmap_goes_on(make: Any, topic: str) -> None:
    node, work = make("costmap", {"costmap": costmap_parameters()}), Work()
    frames = Frames(node, LOG)
    node.give("/tf", transforms("odom", BASE, ago_s=5.0))
    costmap = Costmap(node, LOG, frames, work, "costmap")  # type: ignore[arg-type]
    inputs = {"/scan": scan, "/tf": partial(transforms, "odom", BASE)}

    def has_effect() -> bool:
        costmap.reset_layers()
        node.give("/tf", transforms("odom", BASE, ago_s=0.2))
        measured = scan()
        measured.header.stamp = now(0.1)
        node.give("/scan", measured)
        node.give("/tf", transforms("odom", BASE))
        work.cycle()
        with costmap.lock:
            cells = costmap.grid.costs
            marked = int((cells == LETHAL).sum())
        return marked > 30 and costmap.is_current

    endures(node, topic, inputs[topic], has_effect, 0.3)


def fix() -> Any:
    made = message("sensor_msgs/NavSatFix", "gps", latitude=50.0, longitude=8.0, altitude=100.0)
    made.position_covariance = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    return made


NAVSAT_INPUTS: dict[str, Callable[[], Any]] = {
    "/odometry/filtered": odometry, "/gps/fix": fix, "/imu/data": imu,
}  # fmt: skip


def has_positions(node: Any, work: Work) -> bool:
    """Return whether good messages make a navsat node publish both positions, and both are finite."""
    outputs = [(sent, len(sent)) for sent in (node.sent["/odometry/gps"], node.sent["/gps/filtered"])]
    for _ in range(2):
        node.give("/tf", transforms("odom", "base_link"))
        for name, good in NAVSAT_INPUTS.items():
            node.give(name, good())
        work.cycle()
        work.cycle()
    return all(len(each) > count and finite(each[-1]) for each, count in outputs)


@pytest.mark.parametrize("topic", NAVSAT_INPUTS)
@pytest.mark.parametrize("is_first", [True, False])
def test_navsat_goes_on(make: Any, topic: str, is_first: bool) -> None:
    """With `is_first`, the edge message arrives before the transform is known, in a new node each time."""
    edges = list(edge_messages(NAVSAT_INPUTS[topic]()))
    node = make("navsat", {"publish_filtered_gps": True})

    def new() -> Work:
        work = Work()
        node.inputs.clear()
        node.sent.clear()
        NavsatNode(node, LOG, work)  # type: ignore[arg-type]
        node.give("/tf_static", transforms("base_link", "gps"))
        return work

    work = new()
    assert is_first or has_positions(node, work)
    failed = []
    for change, edge in edges:
        if is_first:
            work = new()
        edge.header.stamp = edge.header.stamp if "stamp" in change else now()
        node.give(topic, edge)
        work.cycle()
        if not has_positions(node, work):
            failed.append(change)
    assert not failed


@pytest.mark.parametrize(("service", "kind"), [("toLL", "ToLL"), ("fromLL", "FromLL"), ("datum", "SetDatum")])
@pytest.mark.parametrize("is_local", [False, True])
def test_navsat_goes_on_after_calls(make: Any, service: str, kind: str, is_local: bool) -> None:
    node, work = make("navsat", {"publish_filtered_gps": True, "use_local_cartesian": is_local}), Work()
    NavsatNode(node, LOG, work)  # type: ignore[arg-type]
    node.give("/tf_static", transforms("base_link", "gps"))
    node.inputs[service] = [answering(node, service)]
    request: Any = load_service_class(f"robot_localization/{kind}")._request_class
    if service == "datum":
        request = partial(request, message("geographic_msgs/GeoPose"))
    endures(node, service, request, partial(has_positions, node, work))


@pytest.mark.parametrize(("topic", "is_first"), [("/scan", True), ("/scan", False), ("/tf", False)])
def test_gmapping_goes_on(make: Any, topic: str, is_first: bool) -> None:
    sides = {"xmin": -3.0, "xmax": 3.0, "ymin": -3.0, "ymax": 3.0}
    small = {
        "particles": 2, "temporalUpdate": 0.0, "maxUrange": 4.0, "map_update_interval": 0.0, "delta": 0.1,
    }  # fmt: skip
    node = make("slam", {"base_frame": BASE, **small, **sides})
    inputs = {"/scan": scan, "/tf": partial(transforms, "odom", BASE)}

    def new() -> tuple[Work, list[Any]]:
        work = Work()
        node.inputs.clear()
        node.sent.clear()
        GmappingNode(node, LOG, work)  # type: ignore[arg-type]
        return work, node.sent["/tf"]

    def has_effect(work: Work, frames: list[Any]) -> bool:
        maps = node.sent["/map"]
        count = len(maps)
        for _ in range(2):
            node.give("/tf", transforms("odom", BASE))
            measured = scan()
            node.give("/tf", transforms("odom", BASE))
            node.give("/scan", measured)
        work.cycle()
        grid = np.array(maps[-1].data) if len(maps) > count else np.zeros(1)
        return finite(frames[-1]) and bool((grid == 100).any())

    made = new()
    assert is_first or has_effect(*made)
    failed = []
    for change, edge in edge_messages(inputs[topic]()):
        if is_first:
            made = new()
            node.give("/tf", transforms("odom", BASE))
        if hasattr(edge, "header") and "stamp" not in change:
            edge.header.stamp = now()
            node.give("/tf", transforms("odom", BASE))  # for the time of the edge message
        node.give(topic, edge)
        if not has_effect(*made):
            failed.append(change)
    assert not failed


PLANS = ["~make_plan", "~NavfnROS/make_plan"]


@pytest.mark.parametrize("topic", ["/move_base_simple/goal", "/odom", "/scan", "/move_base/cancel", *PLANS])
def test_move_base_goes_on(make: Any, topic: str) -> None:
    settings = deepcopy(dict(PARAMETERS["move_base"]))
    settings["global_costmap"] = {
        **settings["local_costmap"], "global_frame": "odom", "width": 4, "height": 4
    }  # fmt: skip
    node, work = make("move_base", settings), Work()
    goals = 0

    def goal() -> Any:
        made = message("geometry_msgs/PoseStamped", "odom")
        made.pose.position.x, made.pose.orientation.w = 0.5, 1.0
        return made

    # The costmaps wait for the first transform.
    listen = node.subscribe

    def subscribe(name: str, kind: Any, callback: Any, **options: Any) -> Any:
        found = listen(name, kind, callback, **options)
        if name == "/tf":
            callback(transforms("odom", BASE))
        return found

    node.subscribe = subscribe
    MoveBase(node, LOG, work)  # type: ignore[arg-type]
    commands = node.sent["/cmd_vel"]
    inputs = {"/move_base_simple/goal": goal, "/odom": odometry, "/scan": scan,
              "/move_base/cancel": partial(message, "actionlib_msgs/GoalID", stamp=now())}  # fmt: skip
    for service in PLANS:
        node.inputs[service] = [answering(node, service)]
        inputs[service] = lambda: load_service_class("nav_msgs/GetPlan")._request_class(goal(), goal(), 9.0)

    def has_effect() -> bool:
        nonlocal goals
        goals += 1
        before = len(commands)
        node.give("/odom", odometry(0.0))
        node.give("/tf", transforms("odom", BASE))
        node.give("/scan", scan())
        node.give("/move_base_simple/goal", goal())
        for _ in range(3):
            node.give("/tf", transforms("odom", BASE))
            work.cycle()
        node.give("/move_base/cancel", message("actionlib_msgs/GoalID"))
        work.cycle()
        sent = commands[before:]
        return any(each.linear.x > 0 or each.angular.z for each in sent) and all(map(finite, sent))

    endures(node, topic, inputs[topic], has_effect)
