"""The nodelet yocs_velocity_smoother/VelocitySmootherNodelet on recorded commands, in lockstep with the test.

Simulated time advances by one period when the nodelet has published what it computes in the one before, and
has noted its inputs.
"""

from contextlib import suppress
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node
from pipros_libraries.nodelets.hosting import Hosting
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.recordings import Recording
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PLUGIN = "yocs_velocity_smoother/VelocitySmootherNodelet"
Clock: Any = load_message_class("rosgraph_msgs/Clock")
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


class Lockstep:
    """Drives the nodelet `/pipros/n` of a host; the robot does at once what it is commanded.

    Attributes:
        commands: what the nodelet has published.
    """

    def __init__(self, node: Node, host: Node, frequency_hz: float) -> None:
        self._clock, self._raw = node.advertise("/clock", Clock), node.advertise("/raw", Twist)
        self._odometry = node.advertise("/pipros/n/odometry", Odometry)
        self._now_ns, self._period_ns = 1000 * NS_PER_S, round(NS_PER_S / frequency_hz)
        # The host's callbacks are called after those of the nodelet, which has subscribed before.
        self.commands, self._heard, self._measured = Inbox(), Inbox(), Inbox()
        host.subscribe("/raw", Twist, self._heard)
        host.subscribe("/pipros/n/odometry", Odometry, self._measured)
        host.subscribe("/pipros/n/smooth_cmd_vel", Twist, self.commands)
        for publisher in (self._clock, self._raw, self._odometry):
            wait_until_connected(publisher)

    def begin(self) -> None:
        """Let time begin, until the nodelet publishes: without a command for some periods, it does not."""
        while not self.commands.messages:
            with suppress(AssertionError):
                self._advance(Twist(), 1.0)

    def go_to(self, velocity: tuple[float, float], target: tuple[float, float]) -> None:
        """Ask for a velocity until the nodelet has reached the target."""
        command = Twist()
        command.linear.x, command.angular.z = velocity
        for _ in range(500):
            self._advance(command)
            if distinct(self.commands)[-1] == target:
                return
        raise AssertionError(distinct(self.commands)[-1])

    def _advance(self, command: Any, timeout_s: float = 60.0) -> None:
        """Publish a command, then the time, then the velocity of the robot."""
        _publish(self._raw, command, self._heard)
        self._now_ns += self._period_ns
        _publish(self._clock, Clock(Time(*divmod(self._now_ns, NS_PER_S))), self.commands, timeout_s)
        measured = Odometry()
        measured.twist.twist = self.commands.messages[-1]
        _publish(self._odometry, measured, self._measured)


def _publish(publisher: Any, message: Any, inbox: Inbox, timeout_s: float = 60.0) -> None:
    """Publish a message, and wait until its effect is in the inbox."""
    count = len(inbox.messages)
    publisher.publish(message)
    wait_until(lambda: len(inbox.messages) > count, timeout_s, publisher.topic, 0.001)


@pytest.mark.parametrize("parameters", [
    {"accel_lim_v": 1.0, "accel_lim_w": 3.0, "speed_lim_v": 0.8, "decel_factor": 2.0},
    {"accel_lim_v": 1.2, "accel_lim_w": 4.0, "robot_feedback": 2, "frequency": 40.0},
    {"accel_lim_v": 1.6, "robot_feedback": 1, "decel_factor": 0.5},
])  # fmt: skip
def test_commands_are_smoothed_as_by_the_genuine_nodelet(
    ros: RosSystem, recording: Recording, parameters: dict[str, Any]
) -> None:
    ros.serve_master()
    recording.give("parameters", parameters)
    environment = Environment(master_uri=ros.master_uri)
    with Node("test", environment=environment) as node:
        node.params.set("/use_sim_time", True)
        node.params.set("/pipros/n", parameters)
        with Node("host", environment=environment) as host:
            host.use_simulated_time()
            remappings = {
                "/pipros/n/raw_cmd_vel": "/raw",
                "/pipros/n/robot_cmd_vel": "/pipros/n/smooth_cmd_vel",
            }
            Hosting(host).load("/pipros/n", PLUGIN, remappings=remappings)
            robot = Lockstep(node, host, parameters.get("frequency", 20.0))
            robot.begin()
            for v, w in ((0.6, 0.0), (2.0, -0.5), (-0.2, 1.5), (0.0, 0.0)):
                recording.give("command", [v, w])
                limit = parameters.get("speed_lim_v", 1.0)
                robot.go_to((v, w), (max(-limit, min(v, limit)), w))
    ours, genuine = distinct(robot.commands), recording.value("commands")
    assert ours == [pytest.approx(each, abs=1e-9) for each in genuine]
    assert len(ours) > 30
