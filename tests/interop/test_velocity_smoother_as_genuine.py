"""The nodelet yocs_velocity_smoother/VelocitySmootherNodelet beside the genuine one."""

from __future__ import annotations

from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.libraries.nodelets.hosting import Hosting
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.rate import Timer
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.small_nodes_oracle import add_to
from tests.support.waiting import wait_until

PLUGIN = "yocs_velocity_smoother/VelocitySmootherNodelet"
Twist: Any = load_message_class("geometry_msgs/Twist")
Odometry: Any = load_message_class("nav_msgs/Odometry")


def distinct(inbox: Inbox) -> list[tuple[float, float]]:
    """Return the commands in order, without those that repeat the one before."""
    found: list[tuple[float, float]] = []
    for each in inbox.messages:
        command = each.linear.x, each.angular.z
        if not found or found[-1] != command:
            found.append(command)
    return found


@pytest.mark.parametrize(
    "parameters",
    [
        {"accel_lim_v": 1.0, "accel_lim_w": 3.0, "speed_lim_v": 0.8, "decel_factor": 2.0},
        {"accel_lim_v": 1.2, "accel_lim_w": 4.0, "robot_feedback": 2, "frequency": 40.0},
        {"accel_lim_v": 1.6, "robot_feedback": 1, "decel_factor": 0.5},
    ],
)
def test_commands_are_smoothed_as_by_the_genuine_nodelet(ros: RosSystem, parameters: dict[str, Any]) -> None:
    add_to(ros.genuine)
    ros.serve_master()
    environment = Environment(master_uri=ros.master_uri)
    boxes = {"/pipros": Inbox(), "/genuine": Inbox()}
    with Node("test", environment=environment) as node, Node("host", environment=environment) as host:
        for side, inbox in boxes.items():
            node.params.set(f"{side}/n", parameters)
            node.subscribe(f"{side}/n/smooth_cmd_vel", Twist, inbox)
            _measure(node, side)
        remappings = {f"{side}/n/raw_cmd_vel": "/raw" for side in boxes}
        remappings |= {f"{side}/n/robot_cmd_vel": f"{side}/n/smooth_cmd_vel" for side in boxes}
        Hosting(host).load("/pipros/n", PLUGIN, remappings=remappings)
        ros.genuine.start(
            "/usr/lib/nodelet/nodelet",
            *("standalone", PLUGIN, "__name:=n", "__ns:=/genuine"),
            *(f"{old}:={new}" for old, new in remappings.items()),
        )
        raw = node.advertise("/raw", Twist)
        wait_until_connected(raw, 2)
        if parameters.get("robot_feedback") == 1:
            for side in boxes:
                ros.wait_for_subscriber(f"{side}/n/odometry")
        command = Twist()
        timer = Timer(node.clock, 150_000_000, lambda _: raw.publish(command))
        for v, w in ((0.6, 0.0), (2.0, -0.5), (-0.2, 1.5), (0.0, 0.0)):
            limit = parameters.get("speed_lim_v", 1.0)
            target = max(-limit, min(v, limit)), w
            command.linear.x, command.angular.z = v, w
            for side, inbox in boxes.items():
                wait_until(
                    lambda inbox=inbox, target=target: distinct(inbox)[-1:] == [target],  # type: ignore[misc]
                    60,
                    lambda side=side, inbox=inbox: f"{side} {distinct(inbox)}",  # type: ignore[misc]
                )
        timer.shutdown()
    ours, genuine = map(distinct, boxes.values())
    assert ours == [pytest.approx(each, abs=1e-9) for each in genuine]
    assert len(ours) > 30


def _measure(node: Node, side: str) -> None:
    """Publish the odometry of a robot that does at once what it is commanded."""
    odometry = node.advertise(f"{side}/n/odometry", Odometry)

    def on_command(command: Any) -> None:
        message = Odometry()
        message.twist.twist = command
        odometry.publish(message)

    node.subscribe(f"{side}/n/smooth_cmd_vel", Twist, on_command)
