"""The nodelet yocs_velocity_smoother/VelocitySmootherNodelet beside the genuine one, in lockstep.

Simulated time advances by one period when both sides have published what they compute in the one before, and
have noted their inputs. In real time, a late genuine nodelet publishes twice at once, of which one is lost.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.libraries.nodelets.hosting import Hosting
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node
from tests.support.nodes import Inbox, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.small_nodes_oracle import add_to
from tests.support.waiting import wait_until

PLUGIN = "yocs_velocity_smoother/VelocitySmootherNodelet"
Clock: Any = load_message_class("rosgraph_msgs/Clock")
Reconfigure: Any = load_service_class("dynamic_reconfigure/Reconfigure")
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
    """Both nodelets at `/pipros/n` and `/genuine/n`, and their commands so far."""

    def __init__(self, node: Node, frequency_hz: float) -> None:
        self.boxes = {"/pipros": Inbox(), "/genuine": Inbox()}
        self._clock, self._raw = node.advertise("/clock", Clock), node.advertise("/raw", Twist)
        self._now_ns, self._period_ns = 1000 * NS_PER_S, round(NS_PER_S / frequency_hz)
        self._barriers = [
            node.client(f"{side}/n/set_parameters", Reconfigure, persistent=True) for side in self.boxes
        ]
        for side, inbox in self.boxes.items():
            _measure(node, side, inbox)

    def begin(self) -> None:
        """Let time begin, and wait until both publish in the same period.

        A nodelet without a command for some periods does not publish, and `go_to` would wait for it.
        """
        for publisher in (self._clock, self._raw):
            wait_until_connected(publisher, len(self.boxes))
        wait_until(self._both_publish)

    def _both_publish(self) -> bool:
        counts = {side: len(each.messages) for side, each in self.boxes.items()}
        self._advance(Twist())
        with suppress(AssertionError):
            wait_until(lambda: all(len(self.boxes[side].messages) > n for side, n in counts.items()), 1.0)
            return True
        return False

    def go_to(self, velocity: tuple[float, float], target: tuple[float, float]) -> None:
        """Ask both for a velocity until they have reached the target."""
        command = Twist()
        command.linear.x, command.angular.z = velocity
        for _ in range(500):
            counts = [len(each.messages) for each in self.boxes.values()]
            self._advance(command)
            for count, inbox in zip(counts, self.boxes.values(), strict=True):
                inbox.wait(count + 1)
            if all(distinct(each)[-1] == target for each in self.boxes.values()):
                return
        raise AssertionError({side: distinct(each)[-1] for side, each in self.boxes.items()})

    def close(self) -> None:
        """Close the connections to the nodelets."""
        for barrier in self._barriers:
            barrier.close()

    def _advance(self, command: Any) -> None:
        self._raw.publish(command)
        for barrier in self._barriers:  # what the nodelets have received by now, they note before they answer
            barrier.call(Reconfigure._request_class())
        self._now_ns += self._period_ns
        self._clock.publish(Clock(Time(*divmod(self._now_ns, NS_PER_S))))


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
    with Node("test", environment=environment) as node:
        node.params.set("/use_sim_time", True)
        both = Lockstep(node, parameters.get("frequency", 20.0))
        with Node("host", environment=environment) as host:
            host.use_simulated_time()
            for side in both.boxes:
                node.params.set(f"{side}/n", parameters)
            remappings = {f"{side}/n/raw_cmd_vel": "/raw" for side in both.boxes}
            remappings |= {f"{side}/n/robot_cmd_vel": f"{side}/n/smooth_cmd_vel" for side in both.boxes}
            Hosting(host).load("/pipros/n", PLUGIN, remappings=remappings)
            ros.genuine.start(
                "/usr/lib/nodelet/nodelet",
                *("standalone", PLUGIN, "__name:=n", "__ns:=/genuine"),
                *(f"{old}:={new}" for old, new in remappings.items()),
            )
            if parameters.get("robot_feedback") == 1:
                for side in both.boxes:
                    ros.wait_for_subscriber(f"{side}/n/odometry")
            both.begin()
            for v, w in ((0.6, 0.0), (2.0, -0.5), (-0.2, 1.5), (0.0, 0.0)):
                limit = parameters.get("speed_lim_v", 1.0)
                both.go_to((v, w), (max(-limit, min(v, limit)), w))
        both.close()
    ours, genuine = map(distinct, both.boxes.values())
    assert ours == [pytest.approx(each, abs=1e-9) for each in genuine]
    assert len(ours) > 30


def _measure(node: Node, side: str, inbox: Inbox) -> None:
    """Publish the odometry of a robot that does at once what it is commanded, then note the command.

    In this order, because the test goes on when the command is noted.
    """
    odometry = node.advertise(f"{side}/n/odometry", Odometry)

    def on_command(command: Any) -> None:
        message = Odometry()
        message.twist.twist = command
        odometry.publish(message)
        inbox(command)

    node.subscribe(f"{side}/n/smooth_cmd_vel", Twist, on_command)
