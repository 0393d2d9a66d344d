"""The filter programs in a running system."""

import itertools
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

LAUNCH = """<launch>
  <node pkg="robot_localization" type="ekf_localization_node" name="filter" output="screen">
    <rosparam>
      frequency: 50
      sensor_timeout: 1.0e+12
      two_d_mode: true
      odom0: odom
      odom0_config: [false, false, false, false, false, false,
                     true, true, false, false, false, true, false, false, false]
    </rosparam>
  </node>
</launch>
"""


@pytest.fixture
def node(ros: RosSystem) -> Iterator[Node]:
    ros.serve_master()
    with Node("a_test", environment=Environment(master_uri=ros.master_uri)) as node:
        yield node


def subscribe(node: Node, topic: str, kind: str) -> Inbox:
    inbox = Inbox()
    node.subscribe(topic, load_message_class(kind), inbox)
    return inbox


def test_a_launched_filter_publishes_pose_transform_and_diagnostics(ros: RosSystem, node: Node) -> None:
    (ros.home / "filter.launch").write_text(LAUNCH)
    estimates = subscribe(node, "/odometry/filtered", "nav_msgs/Odometry")
    transforms = subscribe(node, "/tf", "tf2_msgs/TFMessage")
    diagnostics = subscribe(node, "/diagnostics", "diagnostic_msgs/DiagnosticArray")
    odometry: Any = load_message_class("nav_msgs/Odometry")
    publisher = node.advertise("/odom", odometry, queue_size=10)
    ros.pipros.start("roslaunch", ros.home / "filter.launch")
    wait_until(lambda: publisher.connection_count, 60, "the filter")
    tenths = itertools.count(10_000)

    def drive() -> bool:
        """Drive for 0.1 s at 1 m/s; return whether the robot has arrived and everything was published."""
        message = odometry(child_frame_id="base_link")
        message.header.stamp = Time(*divmod(next(tenths) * 100_000_000, 1_000_000_000))
        message.twist.twist.linear.x = 1.0
        message.twist.covariance = [0.01 if index % 7 == 0 else 0.0 for index in range(36)]
        publisher.publish(message)
        has_arrived = bool(estimates.messages) and estimates.messages[-1].pose.pose.position.x > 1.0
        return has_arrived and bool(transforms.messages) and bool(diagnostics.messages)

    wait_until(drive, 60, "1 m of driving")
    sent = transforms.messages[-1].transforms[0]
    assert (sent.header.frame_id, sent.child_frame_id) == ("odom", "base_link")
    assert estimates.messages[-1].pose.pose.position.z == pytest.approx(0.0)
    names = [status.name for status in diagnostics.messages[-1].status]
    assert names == ["filter: Filter diagnostic updater", "filter: odometry/filtered topic status"]


def test_a_filter_runs_with_a_short_config_and_names_it(ros: RosSystem, node: Node) -> None:
    node.params.set("/filter", {"odom0": "odom", "odom0_config": [True] * 14, "frequency": 0})
    command = ("rosrun", "robot_localization", "ukf_localization_node", "__name:=filter")

    ended = ros.pipros.run(*command)

    assert ended.returncode == 1
    assert "~frequency must be > 0 and finite" in ended.output
    node.params.delete("/filter/frequency")
    running = ros.pipros.start(*command)
    running.wait_for(r"~odom0_config must be a list of 15 booleans")
    ros.wait_for_subscriber("/odom")
    running.press_ctrl_c()
    assert running.wait() == 0
