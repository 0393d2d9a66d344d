"""amcl of pipros and genuine amcl, on the same drive through an apartment."""

from __future__ import annotations

import contextlib
import itertools
import math
from ast import literal_eval
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_service_class
from pipros.node import Node
from pipros.simulation.robots.drive import Pose
from tests.support.both_navigation import SIDES, BothNodes, both_nodes
from tests.support.drives import (
    ROUTE,
    START,
    Moment,
    drive,
    map_message,
    scan_message,
    stamp,
    transform_message,
)
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PARAMETERS: dict[str, Any] = {
    "initial_pose_x": START.x, "initial_pose_y": START.y, "initial_pose_a": START.yaw,
    "initial_cov_xx": 0.04, "initial_cov_yy": 0.04, "initial_cov_aa": 0.02,
    "min_particles": 500, "max_particles": 1000, "laser_max_beams": 60, "save_pose_rate": -1.0,
    "update_min_d": 0.15,
}  # fmt: skip
REMAPS = [f"{name}:=/{name}" for name in ("static_map", "scan", "initialpose")]


def serve_map(node: Node) -> None:
    service: Any = load_service_class("nav_msgs/GetMap")
    node.serve("/static_map", service, lambda _: service._response_class(map_message()))


class Drive:
    """Feeds moments of a drive to both nodes; stores the estimates and transforms."""

    def __init__(self, both: BothNodes) -> None:
        self.both = both
        self.estimates = both.inboxes("amcl_pose", "geometry_msgs/PoseWithCovarianceStamped")
        both.publish("tf_static", transform_message("base_link", "laser", Pose(0.1, 0.05, 0.0), 0.0))

    def feed(self, moment: Moment) -> None:
        """Publish a transform and a scan; wait until both have answered with a transform for its time.

        On a busy machine, the genuine node was seen to leave a scan unanswered, for a reason that is not
        known: then both messages are repeated, which changes nothing without a motion.
        """
        wanted = stamp(moment.time_s + 0.1)

        def answered(side: str) -> bool:
            recent = self.both.transforms[side].messages[-10:]
            return any(
                each.header.frame_id == "map" and each.header.stamp >= wanted
                for message in recent
                for each in message.transforms
            )

        for _ in range(6):
            self.both.publish_tf(transform_message("odom", "base_link", moment.odometry, moment.time_s))
            self.both.publish("scan", scan_message(moment))
            with contextlib.suppress(AssertionError):
                wait_until(lambda: all(map(answered, SIDES)), 10)
                return
        lacking = [side for side in SIDES if not answered(side)]
        raise AssertionError(f"no answer of {lacking} for {moment.time_s}: {self.both.output}")


def numbers(estimate: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return x, y, yaw and their covariance."""
    pose, covariance = estimate.pose.pose, np.array(estimate.pose.covariance).reshape(6, 6)
    yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
    rows = [0, 1, 5]
    return np.array((pose.position.x, pose.position.y, yaw)), covariance[np.ix_(rows, rows)]


def apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    difference: np.ndarray = one - other
    difference[2] = math.remainder(difference[2], math.tau)
    return difference


@pytest.mark.parametrize(
    ("laser", "odometry"),
    [
        ("likelihood_field", "diff"),
        ("beam", "diff-corrected"),
        ("likelihood_field_prob", "omni"),
        ("likelihood_field", "omni-corrected"),
    ],
)
def test_the_pose_is_within_the_covariance_of_genuine(
    plain_ros: RosSystem, laser: str, odometry: str
) -> None:
    moments = list(drive(route=ROUTE[:6]))[::3]
    models = {"laser_model_type": laser, "odom_model_type": odometry, "resample_interval": 1}
    parameters = PARAMETERS | models
    with both_nodes(plain_ros, "amcl", "amcl", parameters, before=serve_map, remaps=REMAPS) as both:
        drives = Drive(both)
        for moment in moments:
            drives.feed(moment)
        wait_until(lambda: len({len(each.messages) for each in drives.estimates.values()}) == 1, 30, "poses")
        own, genuine = (drives.estimates[side].messages for side in SIDES)

    assert [each.header.stamp for each in own] == [each.header.stamp for each in genuine]
    assert len(own) > 20
    pairs = [(numbers(one), numbers(other)) for one, other in zip(own, genuine, strict=True)]
    distances = [
        math.sqrt(apart(mean, other) @ np.linalg.solve(covariance, apart(mean, other)))
        for (mean, _), (other, covariance) in pairs
    ]
    # Both estimates are random: they are a whole deviation apart now and then if few particles count.
    assert np.percentile(distances, 90) < 1.0, np.round(distances, 2)
    assert max(distances) < 3.0, np.round(distances, 2)
    ratios = [np.diagonal(one[1]) / np.diagonal(other[1]) for one, other in pairs]
    assert 0.8 < np.median(np.sqrt(ratios)) < 1.25, np.round(ratios, 2)


def described(description: Any) -> dict[str, Any]:
    """Return the fields of a configuration's description by name, without texts of the authors."""
    found: dict[str, Any] = {}
    for group in description.groups:
        for each in group.parameters:
            constants = literal_eval(each.edit_method)["enum"] if each.edit_method else []
            names = [(constant["name"], constant["type"], constant["value"]) for constant in constants]
            found[each.name] = [group.name, each.type, each.level, names]
    for part in (description.min, description.max, description.dflt):
        for values in (part.bools, part.ints, part.strs, part.doubles):
            for each in values:
                found[each.name].append(each.value)
    return found


def test_interface_parameters_and_settings_are_those_of_genuine(plain_ros: RosSystem) -> None:
    with both_nodes(plain_ros, "amcl", "amcl", {}, before=serve_map, remaps=REMAPS) as both:
        inboxes = both.inboxes("node/parameter_descriptions", "dynamic_reconfigure/ConfigDescription")
        own, genuine = (inboxes[side].wait()[0] for side in SIDES)
        wait_until(
            lambda: all("/node/set_parameters" in both.interface(side)["services"] for side in SIDES),
            30,
            lambda: str([both.interface(side) for side in SIDES]),
        )
        parameters = both.parameters()
        interfaces = [both.interface(side) for side in SIDES]

    assert described(own) == described(genuine)
    assert list(described(own)) == list(described(genuine))
    assert parameters[0] == parameters[1]
    assert {name: type(value) for name, value in parameters[0].items()} == {
        name: type(value) for name, value in parameters[1].items()
    }
    assert interfaces[0] == interfaces[1]


def test_services_initial_poses_and_saved_poses_have_the_effects_of_genuine(plain_ros: RosSystem) -> None:
    moments = list(drive(route=ROUTE[:3]))[::3]
    parameters = PARAMETERS | {"save_pose_rate": 5.0, "force_update_after_set_map": True}
    with both_nodes(plain_ros, "amcl", "amcl", parameters, before=serve_map, remaps=REMAPS) as both:
        clouds = both.inboxes("particlecloud", "geometry_msgs/PoseArray")
        drives = Drive(both)
        drives.feed(moments[0])
        counts = [len(clouds[side].wait(1)) for side in SIDES]
        both.call("request_nomotion_update", "std_srvs/Empty")
        drives.feed(replace(moments[0], time_s=moments[0].time_s + 0.1))
        forced = [len(clouds[side].wait(2)) for side in SIDES]
        both.call("global_localization", "std_srvs/Empty")
        drives.feed(moments[1])
        spread = [clouds[side].wait(3)[2] for side in SIDES]
        initial = drives.estimates["genuine"].messages[0]
        initial.header.frame_id, initial.header.stamp = "map", stamp(moments[1].time_s)
        responses = both.call("set_map", "nav_msgs/SetMap", map=map_message(), initial_pose=initial)
        for moment in moments[2:]:
            drives.feed(moment)
        later = itertools.count(1)

        def saved_after_a_scan() -> list[float]:
            drives.feed(replace(moments[-1], time_s=moments[-1].time_s + 0.1 * next(later)))
            return [each["initial_pose_x"] for each in both.parameters()]

        # A node saves at most five times per second, so one may still have an earlier pose.
        wait_until(lambda: abs(float(np.subtract(*saved_after_a_scan()))) < 0.1, 30, "the same pose")
        saved = [each["initial_pose_x"] for each in both.parameters()]
        last = drives.estimates["pipros"].messages[-1]

    assert (counts, forced) == ([1, 1], [2, 2])
    assert [len(cloud.poses) for cloud in spread] == [1000, 1000]
    widths = [np.std([pose.position.x for pose in cloud.poses]) for cloud in spread]
    assert widths[0] == pytest.approx(widths[1], rel=0.1)
    assert [response.success for response in responses] == [True, True]
    assert saved[0] != START.x
    truth = next(each.truth for each in moments if stamp(each.time_s) == last.header.stamp)
    errors = apart(numbers(last)[0], np.array((truth.x, truth.y, truth.yaw)))
    assert np.abs(errors).max() < 0.2, errors
