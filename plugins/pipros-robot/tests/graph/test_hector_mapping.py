"""The node hector_mapping: a map of five rooms without odometry, its frames, commands and bad messages."""

import logging
import math
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation import plane
from pipros_robot.navigation.hector.hector_node import HectorNode
from pipros_robot.navigation.laser_matcher.icp import between, composed
from pipros_simulation.robots.drive import Pose
from tests.graph.unlinked import Unlinked
from tests.support import drives
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.unlinked_node import BASE, Cycles, UnlinkedNode, endures, finite, message, posed, scan
from tests.support.waiting import wait_until

LOG = logging.getLogger("hector")
LOG.setLevel(logging.CRITICAL + 1)
POSES, MAPS = "/slam_out_pose", "/map"
SMALL = {"base_frame": BASE, "odom_frame": BASE, "map_size": 400, "map_resolution": 0.05}


@pytest.fixture
def make(unlinked: Unlinked) -> Callable[..., tuple[UnlinkedNode, Cycles]]:
    def made(**parameters: Any) -> tuple[UnlinkedNode, Cycles]:
        node, cycles = unlinked("hector_mapping", {**SMALL, **parameters}), Cycles()
        HectorNode(node, LOG, cycles)  # type: ignore[arg-type]
        return node, cycles

    return made


def pose_of(node: UnlinkedNode) -> tuple[float, float, float]:
    return plane.flat_message(node.sent[POSES][-1].pose)


def sent_transforms(node: UnlinkedNode) -> dict[str, Any]:
    """Return the last transform to each frame."""
    return {frame.child_frame_id: frame for sent in node.sent["/tf"] for frame in sent.transforms}


@pytest.mark.timeout(400)  # fifteen seconds of processor time, on a machine that runs many tests
def test_a_drive_without_odometry_yields_the_map_of_the_rooms(make: Any) -> None:
    """In 25 m through five rooms, the error is less than 0.15 m, and the map agrees with the rooms."""
    node, cycles = make(map_size=800)
    start, errors = replace(drives.START, yaw=0.0), []
    for moment in drives.drive(rays=360, start=start):
        truth = between((start.x, start.y, 0.0), (moment.truth.x, moment.truth.y, moment.truth.yaw))
        if not errors:
            first = posed("map")
            plane.fill(first.pose.pose.position, first.pose.pose.orientation, plane.raised(truth))
            node.give("/initialpose", first)
        measured = drives.scan_message(moment)
        measured.header.frame_id = BASE
        node.give("/scan", measured)
        errors.append(between(truth, pose_of(node)))
    cycles.cycle()
    x, y, yaw = np.array(errors).T
    assert np.hypot(x, y).max() < 0.15
    assert np.abs(yaw).max() < 0.03
    (found,) = node.sent[MAPS]
    values = np.array(found.data, np.int8).reshape(found.info.height, found.info.width)
    place = found.info.origin.position
    seen = drives.agreement(values, (place.x, place.y), Pose(start.x, start.y, 0.0))
    assert seen.free_iou > 0.9
    assert seen.walls_near > 0.8


def _as_pose(transform: Any) -> Any:
    return SimpleNamespace(position=transform.translation, orientation=transform.rotation)


def test_the_transform_of_the_odometry_is_corrected_and_the_pose_has_a_frame(make: Any) -> None:
    node, _ = make(odom_frame="odom")
    node.give("/tf", plane.transforms("odom", BASE, plane.raised((3.0, 1.0, 0.0)), 0))
    for _ in range(2):
        one = scan()
        node.give("/tf", plane.transforms("odom", BASE, plane.raised((3.0, 1.0, 0.0)), one.header.stamp))
        node.give("/scan", one)
    found = sent_transforms(node)
    correction = plane.flat_message(_as_pose(found["odom"].transform))
    assert composed(correction, (3.0, 1.0, 0.0)) == pytest.approx(pose_of(node), abs=1e-6)
    assert found["odom"].header.frame_id == found["scanmatcher_frame"].header.frame_id == "map"
    assert node.sent["/poseupdate"][-1].pose.pose == node.sent[POSES][-1].pose


def test_a_command_resets_the_map_and_a_request_pauses_it(make: Any) -> None:
    node, cycles = make()
    cycles.cycle()
    assert not node.sent[MAPS]
    for _ in range(2):
        node.give("/scan", scan())
    cycles.cycle()
    known = np.count_nonzero(np.array(node.sent[MAPS][-1].data) >= 0)
    assert known > 500
    node.give("/syscommand", message("std_msgs/String", data="savegeotiff"))
    node.give("/initialpose", posed("map", 4.0))
    node.give("/scan", scan())
    assert pose_of(node)[0] == pytest.approx(4.0, abs=0.3)
    node.give("/syscommand", message("std_msgs/String", data="reset"))
    pause = node.services["pause_mapping"]
    pause(SimpleNamespace(data=True))
    count = len(node.sent[POSES])
    node.give("/scan", scan())
    assert len(node.sent[POSES]) == count
    pause(SimpleNamespace(data=False))
    node.give("/scan", scan())
    assert pose_of(node) == (0.0, 0.0, 0.0)


def test_heights_and_distances_of_beams_are_limited(make: Any) -> None:
    """The ends of beams of a level laser have its height; those of a tilted laser are up to 0.84 m above."""
    node, _ = make(laser_z_min_value=0.6)
    for pitch in (0.0, -1.0):
        one, turn = scan(), (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2))
        one.header.frame_id = "laser"
        node.give("/tf", plane.transforms(BASE, "laser", (0.0, 0.0, 0.5, *turn), one.header.stamp))
        node.give("/scan", one)
        assert len(node.sent[POSES]) == (pitch != 0.0)
    near, _ = make(laser_min_dist=1.5)
    near.give("/scan", scan())
    assert not near.sent[POSES]


@pytest.mark.parametrize(
    ("name", "value"), [("map_size", 0), ("map_size", 1_000_000), ("update_factor_free", 1.0),
                        ("map_resolution", math.inf)]
)  # fmt: skip
def test_invalid_parameters_are_named(make: Any, name: str, value: float) -> None:
    with pytest.raises(InvalidParameter, match=name):
        make(**{name: value})


@pytest.mark.parametrize("topic", ["/scan", "/initialpose", "/syscommand"])
def test_edge_values_do_not_end_the_mapping(make: Any, topic: str) -> None:
    node, _ = make(map_size=100)
    good: dict[str, Any] = {
        "/scan": scan,
        "/initialpose": lambda: posed("map"),
        "/syscommand": lambda: message("std_msgs/String", data="reset"),
    }

    def has_effect() -> bool:
        before = len(node.sent[POSES])
        for _ in range(2):
            node.give(topic, good[topic]())
            node.give("/scan", scan())
        return len(node.sent[POSES]) > before and finite(node.sent[POSES][-1])

    with np.errstate(all="ignore"):
        endures(node, topic, good[topic], has_effect)


def test_the_program_offers_its_map(ros: RosSystem) -> None:
    ros.serve_master()
    process = ros.pipros.start(
        "rosrun", "hector_mapping", "hector_mapping", *(f"_{key}:={value}" for key, value in SMALL.items()),
        "_map_pub_period:=0.1",
    )  # fmt: skip
    service: Any = load_service_class("nav_msgs/GetMap")
    found = Inbox()
    with Node("robot", environment=Environment(master_uri=ros.master_uri)) as robot:
        robot.subscribe("/map", load_message_class("nav_msgs/OccupancyGrid"), found)
        scans = robot.advertise("/scan", load_message_class("sensor_msgs/LaserScan"), queue_size=5)
        wait_until_connected(scans)

        def is_mapped() -> bool:
            scans.publish(scan())
            return bool(found.messages)

        wait_until(is_mapped, 30)
        answer = robot.client("/dynamic_map", service).call(service._request_class(), 60).map
    assert (answer.info.width, answer.info.resolution) == (400, pytest.approx(0.05))
    assert 100 in answer.data
    process.press_ctrl_c()
    assert process.wait() == 0


def test_scans_with_thousands_of_beams_take_little_memory(make: Any) -> None:
    node, _ = make(map_size=800, map_resolution=0.025)
    many = scan()
    many.ranges, many.range_max, many.angle_increment = [8.0] * 30_000, 9.0, 6.0 / 30_000
    tracemalloc.start()
    node.give("/scan", many)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(node.sent[POSES]) == 1
    assert peak < 400_000_000
