"""The node marker_server of interactive_marker_twist_server."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.teleoperation.twist_marker import NAMESPACE, Scales
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

Feedback: Any = load_message_class("visualization_msgs/InteractiveMarkerFeedback")


def test_velocities_are_scaled_and_limited_by_axis() -> None:
    scales = Scales({"x": (2.0, -0.5, 1.0), "z": (1.0, -1.0, 1.0)}, angular=0.5, greatest_turn=0.3)
    assert scales.velocity((0.2, 9.0, -0.4), 0.1) == ((0.4, 0.0, -0.4), 0.05)
    assert scales.velocity((5.0, 0.0, 5.0), 2.0) == ((1.0, 0.0, 1.0), 0.3)
    assert scales.velocity((-5.0, 0.0, -5.0), -2.0) == ((-0.5, 0.0, -1.0), -0.3)


class Viewer:
    """A viewer like rviz, on one marker server."""

    def __init__(self, node: Node) -> None:
        self.commands, self.updates, self.full = Inbox(), Inbox(), Inbox()
        for topic, kind, inbox in (
            ("/twist_marker_server/cmd_vel", "geometry_msgs/Twist", self.commands),
            (f"/{NAMESPACE}/update", "visualization_msgs/InteractiveMarkerUpdate", self.updates),
            (f"/{NAMESPACE}/update_full", "visualization_msgs/InteractiveMarkerInit", self.full),
        ):
            node.subscribe(topic, load_message_class(kind), inbox)
        self._feedback = node.advertise(f"/{NAMESPACE}/feedback", Feedback, queue_size=5)

    def connect(self) -> None:
        self.full.wait()
        wait_until_connected(self._feedback)

    def drag(self, event: int = Feedback.POSE_UPDATE, x: float = 0.0, yaw: float = 0.0, **more: Any) -> Any:
        """Send feedback, and return the command that it causes."""
        count = len(self.commands.messages)
        feedback = Feedback(marker_name="husky_twist_marker", client_id="rviz", event_type=event)
        feedback.pose.position.x = x
        feedback.pose.orientation.z, feedback.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        for name, value in more.items():
            setattr(feedback.pose.position, name, value)
        self._feedback.publish(feedback)
        return self.commands.wait(count + 1)[count]


@pytest.fixture
def server(ros: RosSystem) -> Iterator[tuple[Viewer, Process]]:
    ros.serve_master()
    with Node("viewer", environment=Environment(master_uri=ros.master_uri)) as node:
        scale = "{x: 1.0, y: 0.5}"
        high, low = "{x: 0.8, y: 0.2}", "{x: -0.4}"
        process = ros.pipros.start(
            "rosrun", "interactive_marker_twist_server", "marker_server", "__name:=twist_marker_server",
            "_robot_name:=husky", "_link_name:=/base_footprint", f"_linear_scale:={scale}",
            f"_max_positive_linear_velocity:={high}", f"_max_negative_linear_velocity:={low}",
        )  # fmt: skip
        viewer = Viewer(node)
        viewer.connect()
        yield viewer, process
        process.press_ctrl_c()
        assert process.wait() == 0


def test_a_marker_drives_the_robot_and_returns_to_it(server: tuple[Viewer, Process]) -> None:
    viewer, process = server
    (marker,) = viewer.full.messages[0].markers
    assert (marker.name, marker.header.frame_id) == ("husky_twist_marker", "base_footprint")
    assert [each.interaction_mode for each in marker.controls] == [3, 3, 5]  # two axes, one turn
    process.wait_for("must contain y, as linear_scale does: 0 is used")
    assert viewer.drag(x=0.3, yaw=0.1).linear.x == pytest.approx(0.3)
    assert viewer.drag(Feedback.KEEP_ALIVE, x=-3.0, yaw=-0.1).angular.z == pytest.approx(-0.22)
    assert viewer.drag(x=3.0).linear.x == pytest.approx(0.8)
    assert viewer.drag(y=-1.0).linear.y == 0.0

    def is_back() -> bool:
        poses = [pose for update in viewer.updates.messages for pose in update.poses]
        return bool(poses) and poses[-1].pose.position.x == 0.0 and poses[-1].name == marker.name

    wait_until(is_back, 30)


def test_a_released_or_invalid_marker_stops_the_robot(server: tuple[Viewer, Process]) -> None:
    viewer, _ = server
    still = load_message_class("geometry_msgs/Twist")()
    assert viewer.drag(x=0.3) != still
    assert viewer.drag(Feedback.MOUSE_UP, x=0.3) == still
    assert viewer.drag(x=0.3) != still
    assert viewer.drag(x=math.nan) == still
    assert viewer.drag(x=1e308, z=1e308).linear.x == pytest.approx(0.8)


def test_a_server_says_every_half_second_that_it_is_there(server: tuple[Viewer, Process]) -> None:
    viewer, _ = server
    viewer.updates.messages.clear()
    wait_until(
        lambda: len([each for each in viewer.updates.messages if each.type == each.KEEP_ALIVE]) > 2, 30
    )
