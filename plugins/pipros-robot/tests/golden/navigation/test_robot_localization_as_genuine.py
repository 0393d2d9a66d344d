"""The filters of robot_localization, on recorded messages: their estimates equal the genuine ones."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from tests.support.both_navigation import SIDES, BothNodes, end_node, start_node
from tests.support.processes import Process
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

_CLOCK: Any = load_message_class("rosgraph_msgs/Clock")


class BothFilters(BothNodes):
    """Both filters, and their estimates."""

    def __init__(self, node: Node, process: Process, recording: Recording) -> None:
        super().__init__(node, process, "filter", recording)
        self.estimates = self.inboxes("odometry/filtered", "nav_msgs/Odometry")
        # An estimate is published once: it would be lost on its way to a subscription that is not connected.
        wait_until(lambda: self.subscribers["odometry/filtered"].connection_count, 60, lambda: self.output)

    def set_clock(self, time_s: float) -> None:
        """Publish simulated time, in seconds after the first message."""
        now = Time(*divmod(round((1000.0 + time_s) * 1e9), 1_000_000_000))
        self._publisher("/clock", _CLOCK, 1).publish(_CLOCK(now))

    def publish_next(self, topic: str, *, to: str = "", subscribers: int = 1) -> Any:
        return super().publish_next(topic, to=to, subscribers=subscribers)

    def feed(self, topic: str) -> float:
        """Publish the next measurement; return the difference of the estimates for its time."""
        return self.difference_at(self.publish_next(topic).header.stamp.to_sec())

    def difference_at(self, stamp_s: float) -> float:
        """Wait until pipros has published an estimate for a time; return how far both estimates are apart."""
        return difference(*self.wait_for(stamp_s))

    def wait_for(self, stamp_s: float) -> tuple[Any, Any]:
        """Return the first estimates of both sides that are not older."""

        def found(side: str) -> Any:
            estimates = self.estimates[side].messages
            return next((e for e in estimates if e.header.stamp.to_sec() >= stamp_s - 1e-5), None)

        wait_until(lambda: found("pipros"), 30, lambda: f"an estimate for {stamp_s}: {self.output}", 0.001)
        own, genuine = map(found, SIDES)
        assert genuine, f"no estimate for {stamp_s} is recorded"
        return own, genuine


@contextmanager
def both_filters(
    ros: RosSystem,
    recording: Recording,
    program: str,
    parameters: Mapping[str, Any],
    *,
    simulated: bool = False,
) -> Iterator[BothFilters]:
    """Run the filter with these parameters. Its frequency is 200 Hz if it is not given."""
    ros.serve_master()
    recording.give("parameters", parameters)
    recording.give("simulated time", simulated)
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        if simulated:
            node.params.set("/use_sim_time", True)
        node.params.set("/pipros/filter", {"frequency": 200.0, "sensor_timeout": 1e12, **parameters})
        process = start_node(ros, "robot_localization", program, "filter", "cmd_vel:=/cmd_vel")
        yield BothFilters(node, process, recording)
        end_node(process)


def difference(one: Any, other: Any) -> float:
    """Return the greatest difference between two estimates; of variances, relative to 1 at least."""
    largest = 0.0
    for part, kind in (("pose", "pose"), ("twist", "twist")):
        first, second = getattr(one, part), getattr(other, part)
        a, b = np.array(first.covariance), np.array(second.covariance)
        largest = max(largest, float(np.max(np.abs(a - b) / np.maximum(1.0, np.abs(b)))))
        largest = max(
            largest, float(np.max(np.abs(_numbers(getattr(first, kind)) - _numbers(getattr(second, kind)))))
        )
    return max(largest, float(abs(one.header.stamp.to_sec() - other.header.stamp.to_sec())))


def _numbers(message: Any) -> Any:
    """Return all numbers in a message. Quaternions q and -q are the same rotation: w is positive."""
    numbers: list[float] = []
    for name in message.__slots__:
        part = getattr(message, name)
        values = [getattr(part, axis) for axis in part.__slots__]
        numbers += [-value for value in values] if len(values) == 4 and values[3] < 0 else values
    return np.array(numbers)


LIMIT = 1e-6
PLANAR = [True, True, False, False, False, True, True, True, False, False, False, True] + [False] * 3
POSE_6 = [True] * 6 + [False] * 9
ALL_12 = [True] * 12 + [False] * 3
TWIST_6 = [False] * 6 + [True] * 6 + [False] * 3
IMU = [False] * 3 + [True] * 3 + [False] * 3 + [True] * 6


CASES: dict[str, tuple[dict[str, Any], list[str]]] = {
    "planar odometry": (
        {"two_d_mode": True, "odom0": "/odom0", "odom0_config": PLANAR},
        ["/odom0"],
    ),
    "everything in space": (
        {"odom0": "/odom0", "odom0_config": ALL_12, "imu0": "/imu0", "imu0_config": IMU},
        ["/odom0", "/imu0"],
    ),
    "four kinds, dynamic noise": (
        {
            "odom0": "/odom0", "odom0_config": ALL_12, "pose0": "/pose0", "pose0_config": POSE_6,
            "twist0": "/twist0", "twist0_config": TWIST_6, "imu0": "/imu0", "imu0_config": IMU,
            "dynamic_process_noise_covariance": True, "imu0_remove_gravitational_acceleration": True,
        },
        ["/odom0", "/pose0", "/twist0", "/imu0"],
    ),
    "differential odometry": (
        {"odom0": "/odom0", "odom0_config": ALL_12, "odom0_differential": True},
        ["/odom0"],
    ),
    "relative odometry": (
        {"odom0": "/odom0", "odom0_config": ALL_12, "odom0_relative": True},
        ["/odom0"],
    ),
    "rejected measurements": (
        {
            "odom0": "/odom0", "odom0_config": ALL_12, "odom0_pose_rejection_threshold": 2.0,
            "odom0_twist_rejection_threshold": 2.0,
        },
        ["/odom0"],
    ),
    "pose of another frame": (
        {"odom0": "/odom0", "odom0_config": POSE_6, "odom0_pose_use_child_frame": True},
        ["/odom0"],
    ),
    "imu on a turning arm": (  # without angular acceleration, which depends on the time of the cycles
        {
            "imu0": "/imu0", "imu0_config": [False] * 12 + [True] * 3,
            "initial_state": [0.0] * 9 + [0.1, 0.2, 0.9] + [0.0] * 3,
        },
        ["/imu0"],
    ),
    "other frames": (
        {
            "odom0": "/odom0", "odom0_config": PLANAR, "imu0": "/imu0", "imu0_config": IMU,
            "twist0": "/twist0", "twist0_config": TWIST_6, "pose0": "/pose0", "pose0_config": POSE_6,
            "imu0_remove_gravitational_acceleration": True,
        },
        ["/odom0", "/imu0", "/twist0", "/pose0"],
    ),
}  # fmt: skip

EXTENDED = [("ekf_localization_node", case) for case in CASES]
# The points of the unscented filter need a covariance without the correlations that two_d_mode leaves over.
# They are spread further than by default, because rounding errors grow with 1 / alpha².
UNSCENTED = [("ukf_localization_node", case) for case in CASES if case != "planar odometry"]


@pytest.mark.parametrize(("program", "case"), [*EXTENDED, *UNSCENTED])
def test_the_estimates_are_the_same(ros: RosSystem, recording: Recording, program: str, case: str) -> None:
    parameters, inputs = CASES[case]
    common = {"publish_tf": False, "transform_timeout": 10.0, "alpha": 1.0}
    # Genuine filters treat a second message otherwise if it arrives before the cycle after the first one.
    pause_s = 1.0 if "initial_state" in parameters else 0.0
    with both_filters(ros, recording, program, {**common, **parameters}) as both:
        both.publish_next("/tf_static")
        found = [both.feed(inputs[0])]
        time.sleep(pause_s)
        found += [both.feed(inputs[index % len(inputs)]) for index in range(1, 40)]

    assert max(found) < LIMIT, found


def toggle(both: BothFilters) -> list[bool]:
    """Leave both filters on. The calls are answered after the messages that arrived before them."""
    responses = both.call("filter/toggle", "robot_localization/ToggleFilterProcessing", on=True)
    return [each.status for each in responses]


def test_commands_move_both_in_the_same_way(ros: RosSystem, recording: Recording) -> None:
    parameters = {
        "odom0": "/odom0", "odom0_config": PLANAR, "use_control": True, "control_timeout": 1e12,
        "control_config": [True, False, False, False, False, True], "acceleration_limits": [1.3] * 6,
        "deceleration_limits": [0.7] * 6, "acceleration_gains": [0.8] * 6, "deceleration_gains": [1.1] * 6,
    }  # fmt: skip
    with both_filters(ros, recording, "ekf_localization_node", {"publish_tf": False, **parameters}) as both:
        both.publish_next("/cmd_vel")
        for _ in range(30):
            assert toggle(both) == [False, False]
        found = [both.feed("/odom0") for _ in range(20)]

    assert max(found) < LIMIT, found


def test_late_measurements_are_applied_in_their_order(ros: RosSystem, recording: Recording) -> None:
    parameters = {
        "odom0": "/odom0", "odom0_config": ALL_12, "pose0": "/pose0", "pose0_config": POSE_6,
        "pose0_queue_size": 10, "smooth_lagged_data": True, "history_length": 1.0,
    }  # fmt: skip
    found = []
    with both_filters(ros, recording, "ekf_localization_node", {"publish_tf": False, **parameters}) as both:
        for _ in range(10):
            found += [both.feed("/odom0"), both.feed("/odom0")]
            late = both.publish_next("/pose0").header.stamp
            assert late < both.estimates["pipros"].messages[-1].header.stamp
            found.append(both.feed("/pose0"))

    assert max(found) < LIMIT, found


def test_predictions_and_a_new_pose_in_simulated_time(ros: RosSystem, recording: Recording) -> None:
    parameters = {
        "odom0": "/odom0", "odom0_config": ALL_12, "frequency": 10.0, "sensor_timeout": 5.0,
        "world_frame": "map",
    }  # fmt: skip
    found = []
    with both_filters(ros, recording, "ekf_localization_node", parameters, simulated=True) as both:
        both.publish_next("/tf_static")

        def predict(time_s: float) -> float:
            """Move the clock, and return the difference of the predictions for this time."""
            both.set_clock(time_s)
            return both.difference_at(1000.0 + time_s)

        both.set_clock(0.0)
        both.publish_next("/odom0")
        for step in range(1, 45):  # until the first cycle after the message; nothing is predicted yet
            if both.estimates["pipros"].messages:
                break
            both.set_clock(0.1 * step)
            assert toggle(both) == [False, False]
        found += [both.difference_at(1000.0), *(predict(time_s) for time_s in (10.0, 15.0, 20.0))]
        both.call_next("set_pose", "robot_localization/SetPose")
        found += [predict(time_s) for time_s in (25.0, 30.0)]
        wait_until(lambda: len(both.transforms["pipros"].messages) >= 6, 30, "transforms")
        sent = [both.transforms[side].messages[-1].transforms[0] for side in SIDES]

    assert max(found) < LIMIT, found
    assert [(each.header.frame_id, each.child_frame_id) for each in sent] == [("map", "odom")] * 2
    corrections = [numbers_in(each.transform.translation, each.transform.rotation) for each in sent]
    assert corrections[0] == pytest.approx(corrections[1], abs=LIMIT)


def numbers_in(*parts: Any) -> list[float]:
    return [getattr(part, axis) for part in parts for axis in part.__slots__]
