"""amcl on a recorded drive through an apartment, beside genuine amcl.

Genuine amcl draws other random numbers in each of seven runs; pipros is compared with their mean.
"""

import itertools
import math
from ast import literal_eval
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_simulation.robots.drive import Pose
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
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PARAMETERS: dict[str, Any] = {
    "initial_pose_x": START.x, "initial_pose_y": START.y, "initial_pose_a": START.yaw,
    "initial_cov_xx": 0.04, "initial_cov_yy": 0.04, "initial_cov_aa": 0.02,
    "min_particles": 500, "max_particles": 1000, "laser_max_beams": 60, "save_pose_rate": -1.0,
    "update_min_d": 0.15,
}  # fmt: skip
REMAPS = [f"{name}:=/{name}" for name in ("static_map", "scan", "initialpose")]


def serve_map(recording: Recording, node: Node) -> None:
    service: Any = load_service_class("nav_msgs/GetMap")
    given = recording.give("serve /static_map", map_message())
    node.serve("/static_map", service, lambda _: service._response_class(given))


def serve_map_with_seed(recording: Recording, node: Node) -> None:
    """Also make pipros draw the same random numbers in each run."""
    node.params.set("/pipros/node/seed", 2)
    serve_map(recording, node)


class Drive:
    """Feeds moments of a drive to the node; stores the estimates and transforms."""

    def __init__(self, both: BothNodes) -> None:
        self.both = both
        self.estimates = both.inboxes("amcl_pose", "geometry_msgs/PoseWithCovarianceStamped")
        both.publish("tf_static", transform_message("base_link", "laser", Pose(0.1, 0.05, 0.0), 0.0))
        wait_until(lambda: "using a map" in both.output, 60, "the map, without which scans are ignored")

    def feed(self, moment: Moment, *, is_repeated: bool = False) -> None:
        """Publish a transform and a scan; wait until the node has answered with a transform for its time.

        Moments that a test repeats until something happens are not among the inputs.
        """
        wanted = stamp(moment.time_s + 0.1)
        transform = transform_message("odom", "base_link", moment.odometry, moment.time_s)
        self.both.publish_tf(transform, is_input=not is_repeated)
        self.both.publish("scan", scan_message(moment), is_input=not is_repeated)

        def has_answered() -> bool:
            recent = self.both.transforms["pipros"].messages[-10:]
            return any(
                each.header.frame_id == "map" and each.header.stamp >= wanted
                for message in recent
                for each in message.transforms
            )

        wait_until(has_answered, 60, lambda: f"no answer for {moment.time_s}: {self.both.output}")


def numbers(estimate: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return x, y, yaw and their covariance."""
    pose, covariance = estimate.pose.pose, np.array(estimate.pose.covariance).reshape(6, 6)
    yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
    rows = [0, 1, 5]
    return np.array((pose.position.x, pose.position.y, yaw)), covariance[np.ix_(rows, rows)]


def mean(runs: Iterable[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean pose and the mean covariance."""
    poses, covariances = map(np.array, zip(*runs, strict=True))
    first = poses[0]
    return first + np.mean([apart(pose, first) for pose in poses], axis=0), covariances.mean(axis=0)


def apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    difference: np.ndarray = one - other
    difference[2] = math.remainder(difference[2], math.tau)
    return difference


@pytest.mark.parametrize(("laser", "odometry"), [
    ("likelihood_field", "diff"), ("beam", "diff-corrected"), ("likelihood_field_prob", "omni"),
    ("likelihood_field", "omni-corrected"),
])  # fmt: skip
def test_the_pose_is_within_the_covariance_of_genuine(
    ros: RosSystem, recording: Recording, laser: str, odometry: str
) -> None:
    moments = list(drive(route=ROUTE[:6]))[::3]
    models = {"laser_model_type": laser, "odom_model_type": odometry, "resample_interval": 1}
    parameters = PARAMETERS | models
    with both_nodes(
        ros,
        recording,
        "amcl",
        "amcl",
        parameters,
        before=partial(serve_map_with_seed, recording),
        remaps=REMAPS,
    ) as both:
        drives = Drive(both)
        for moment in moments:
            drives.feed(moment)
        own = drives.estimates["pipros"].messages
        kind = load_message_class("geometry_msgs/PoseWithCovarianceStamped")
        runs = [recording.messages("amcl_pose", kind, run) for run in range(len(recording.runs))]
        wait_until(lambda: len(own) >= len(runs[0]), 30, "poses")

    for run in runs:
        assert [each.header.stamp for each in own] == [each.header.stamp for each in run]
    assert len(own) > 20
    pairs = [
        (numbers(one), mean(numbers(each) for each in others))
        for one, *others in zip(own, *runs, strict=True)
    ]
    distances = [
        math.sqrt(apart(pose, other) @ np.linalg.solve(covariance, apart(pose, other)))
        for (pose, _), (other, covariance) in pairs
    ]
    # In deviations. Each genuine run beside the mean of the others: 0.50, 0.65 and 4 % at most.
    assert np.percentile(distances, 90) < 0.7, np.round(distances, 2)
    assert max(distances) < 1.0, np.round(distances, 2)
    ratios = [np.diagonal(one[1]) / np.diagonal(other[1]) for one, other in pairs]
    assert 0.9 < np.median(np.sqrt(ratios)) < 1.1, np.round(ratios, 2)


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


def test_interface_parameters_and_settings_are_those_of_genuine(ros: RosSystem, recording: Recording) -> None:
    with both_nodes(
        ros, recording, "amcl", "amcl", {}, before=partial(serve_map, recording), remaps=REMAPS
    ) as both:
        inboxes = both.inboxes("node/parameter_descriptions", "dynamic_reconfigure/ConfigDescription")
        own, genuine = (inboxes[side].wait()[0] for side in SIDES)
        wait_until(
            lambda: both.interface("pipros") == both.interface("genuine"),
            30,
            lambda: str([both.interface(side) for side in SIDES]),
        )
        parameters = both.parameters()

    assert described(own) == described(genuine)
    assert list(described(own)) == list(described(genuine))
    assert parameters[0] == parameters[1]
    assert {name: type(value) for name, value in parameters[0].items()} == {
        name: type(value) for name, value in parameters[1].items()
    }


def test_services_initial_poses_and_saved_poses_have_the_effects_of_genuine(
    ros: RosSystem, recording: Recording
) -> None:
    moments = list(drive(route=ROUTE[:3]))[::3]
    parameters = PARAMETERS | {"save_pose_rate": 5.0, "force_update_after_set_map": True}
    with both_nodes(
        ros,
        recording,
        "amcl",
        "amcl",
        parameters,
        before=partial(serve_map_with_seed, recording),
        remaps=REMAPS,
    ) as both:
        clouds = both.inboxes("particlecloud", "geometry_msgs/PoseArray")["pipros"]
        drives = Drive(both)
        drives.feed(moments[0])
        assert len(clouds.wait(1)) == recording.step("clouds") == 1
        both.call("request_nomotion_update", "std_srvs/Empty")
        drives.feed(replace(moments[0], time_s=moments[0].time_s + 0.1))
        assert len(clouds.wait(2)) == recording.step("clouds") == 2
        both.call("global_localization", "std_srvs/Empty")
        drives.feed(moments[1])
        spread = np.array([(each.position.x, each.position.y) for each in clouds.wait(3)[2].poses])
        initial = drives.estimates["genuine"].messages[0]
        initial.header.frame_id, initial.header.stamp = "map", stamp(moments[1].time_s)
        responses = both.call("set_map", "nav_msgs/SetMap", map=map_message(), initial_pose=initial)
        for moment in moments[2:]:
            drives.feed(moment)
        last = drives.estimates["pipros"].messages[-1]
        saved = both.parameters()[1]["initial_pose_x"]
        later = itertools.count(1)

        def saved_after_a_scan() -> float:
            time_s = moments[-1].time_s + 0.1 * next(later)
            drives.feed(replace(moments[-1], time_s=time_s), is_repeated=True)
            return float(both.parameters()[0]["initial_pose_x"])

        # A node saves at most five times per second, so the saved pose may be an earlier one.
        wait_until(lambda: abs(saved_after_a_scan() - saved) < 0.1, 30, "the same pose")

    genuine = recording.value("spread")
    assert spread.shape == genuine.shape == (1000, 2)
    assert spread.std(axis=0) == pytest.approx(genuine.std(axis=0), rel=0.1)
    assert spread.mean(axis=0) == pytest.approx(genuine.mean(axis=0), abs=0.5)
    assert [response.success for response in responses] == [True, True]
    truth = next(each.truth for each in moments if stamp(each.time_s) == last.header.stamp)
    errors = apart(numbers(last)[0], np.array((truth.x, truth.y, truth.yaw)))
    assert np.abs(errors).max() < 0.2, errors
