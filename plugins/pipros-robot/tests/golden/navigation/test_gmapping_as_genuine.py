"""slam_gmapping on a recorded drive through an apartment, beside the genuine node.

The genuine node draws other random numbers in each of seven runs: pipros is compared with their mean.
"""

import math
from collections.abc import Iterable
from dataclasses import astuple, replace
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class
from pipros_simulation.robots.drive import Pose
from tests.support.both_navigation import SIDES, BothNodes, both_nodes
from tests.support.drives import (
    ROUTE,
    Agreement,
    Moment,
    agreement,
    apart,
    drive,
    scan_message,
    transform_message,
)
from tests.support.nodes import Inbox
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

BEGIN = Pose(2.9, 1.0, 0.0)
PARAMETERS: dict[str, Any] = {
    "xmin": -8.0, "ymin": -8.0, "xmax": 12.0, "ymax": 12.0, "linearUpdate": 0.0, "angularUpdate": 0.0,
    "map_update_interval": 0.0, "particles": 15, "srr": 0.05, "srt": 0.05, "str": 0.05, "stt": 0.05,
    "seed": 1,
}  # fmt: skip


def drawn(both: BothNodes, moments: Iterable[Moment], *, inverted: bool = False) -> dict[str, Inbox]:
    """Feed the node; return the maps. Every scan is processed, and is followed by a map."""
    maps = both.inboxes("map", "nav_msgs/OccupancyGrid")
    transform = transform_message("base_link", "laser", Pose(), 0.0)
    if inverted:
        rotation = transform.transforms[0].transform.rotation
        rotation.x, rotation.w = 1.0, 0.0
    both.publish("tf_static", transform)
    for index, moment in enumerate(moments):
        ranges = np.roll(moment.ranges[::-1], 1) if inverted else moment.ranges
        both.publish_tf(transform_message("odom", "base_link", moment.odometry, moment.time_s))
        both.publish("scan", scan_message(replace(moment, ranges=ranges)))
        wait_until(
            lambda: len(maps["pipros"].messages) > index,  # noqa: B023
            60,
            lambda: f"{index}: {both.output}",  # noqa: B023
        )
    return maps


def judged(message: Any) -> Agreement:
    info = message.info
    values = np.array(message.data, np.int8).reshape(info.height, info.width)
    assert set(np.unique(values)) <= {-1, 0, 100}
    return agreement(values, (info.origin.position.x, info.origin.position.y), BEGIN)


def mean_of_runs(recording: Recording) -> Agreement:
    """Return the mean agreement of the genuine maps."""
    kind = load_message_class("nav_msgs/OccupancyGrid")
    runs = [judged(recording.messages("map", kind, run)[-1]) for run in range(len(recording.runs))]
    return Agreement(*np.mean([astuple(each) for each in runs], axis=0).tolist())


def test_maps_agree_with_the_apartment_as_well_as_those_of_genuine(
    ros: RosSystem, recording: Recording
) -> None:
    with both_nodes(ros, recording, "gmapping", "slam_gmapping", PARAMETERS, remaps=["scan:=/scan"]) as both:
        maps = drawn(both, apart(drive(start=BEGIN, route=ROUTE[:9], noise=0.02), 0.3, 0.2))
        entropies = both.inboxes("node/entropy", "std_msgs/Float64")
        assert entropies["genuine"].messages
        entropies["pipros"].wait()
        served = both.call("dynamic_map", "nav_msgs/GetMap")
        interfaces = [both.interface(side) for side in SIDES]

    own, genuine = (maps[side].messages[-1] for side in SIDES)
    ours, theirs = judged(own), mean_of_runs(recording)
    assert ours.walls_near > max(0.97, theirs.walls_near - 0.02), (ours, theirs)
    assert ours.free_iou > theirs.free_iou - 0.01, (ours, theirs)
    assert ours.walls_seen > theirs.walls_seen - 0.02, (ours, theirs)
    for field in ("width", "height", "resolution", "origin"):
        assert getattr(own.info, field) == getattr(genuine.info, field)
    assert own.header.frame_id == genuine.header.frame_id == "map"
    assert [response.map.info.width for response in served] == [own.info.width] * 2
    assert interfaces[0] == interfaces[1]


def test_an_inverted_laser_is_turned_as_in_genuine(ros: RosSystem, recording: Recording) -> None:
    # The map grows: the first size does not contain the apartment.
    parameters = PARAMETERS | {"xmin": -1.0, "ymin": -1.0, "xmax": 1.0, "ymax": 1.0}
    with both_nodes(ros, recording, "gmapping", "slam_gmapping", parameters, remaps=["scan:=/scan"]) as both:
        maps = drawn(both, list(drive(start=BEGIN, route=ROUTE[:5], noise=0.01))[::7], inverted=True)
        transforms = {
            side: [each for message in both.transforms[side].messages for each in message.transforms]
            for side in SIDES
        }

    own, genuine = (maps[side].messages[-1] for side in SIDES)
    ours, theirs = judged(own), mean_of_runs(recording)
    assert (own.info.width, own.info.height) == (genuine.info.width, genuine.info.height)
    corners = [(info.origin.position.x, info.origin.position.y) for info in (own.info, genuine.info)]
    assert corners[0] == pytest.approx(corners[1])
    assert ours.walls_near > max(0.6, theirs.walls_near - 0.3), (ours, theirs)
    last = {side: [each for each in transforms[side] if each.header.frame_id == "map"][-1] for side in SIDES}
    assert last["pipros"].child_frame_id == last["genuine"].child_frame_id == "odom"
    shifts = [last[side].transform.translation for side in SIDES]
    assert math.hypot(shifts[0].x - shifts[1].x, shifts[0].y - shifts[1].y) == pytest.approx(0.0, abs=0.2)
