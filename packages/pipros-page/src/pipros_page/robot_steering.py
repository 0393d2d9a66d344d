"""`rqt_robot_steering`: sliders for a robot's linear and angular velocity, by default on `/cmd_vel`."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.libraries.nodes.params import number, raw
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros.server.node_page import served_page
from pipros.server.sliders.slider_page import Slider, SliderPage

PERIOD_S: Final = 0.1
LINEAR, ANGULAR = "linear", "angular"
FASTEST: Final = 3.0
"""Default maximum of both sliders, in m/s and rad/s."""


class Steering:
    """Velocities set with sliders. Call `publish` periodically to publish them.

    The robot stops when a browser leaves the page, and when the node ends.
    """

    def __init__(self, node: Node) -> None:
        """Read the parameters `~default_topic`, `~default_vx_max`, `~default_vw_min` and so on.

        Raises:
            InvalidName: the topic's name is not legal.
        """
        self._lock = threading.Lock()
        self._speeds = {LINEAR: 0.0, ANGULAR: 0.0}
        self._was_moving = False
        self._ranges = {
            kind: (
                number(node, f"default_{short}_min", -FASTEST),
                number(node, f"default_{short}_max", FASTEST),
            )
            for kind, short in ((LINEAR, "vx"), (ANGULAR, "vw"))
        }
        self._twist_class: Any = load_message_class("geometry_msgs/Twist")
        topic = str(raw(node, "default_topic", "/cmd_vel"))
        self._commands = node.advertise(topic, self._twist_class, queue_size=1)
        node.on_shutdown(self._end)
        self.page = SliderPage(
            f"Steering {node.resolve(topic)}",
            node.name,
            self.sliders,
            self.move,
            {"Stop": self.stop},
            on_left=self.stop,
        )

    def sliders(self) -> list[Slider]:
        """Return both sliders."""
        units = {LINEAR: "m/s", ANGULAR: "rad/s"}
        return [Slider(kind, *self._ranges[kind], self._speeds[kind], units[kind]) for kind in units]

    def move(self, slider: str, value: float) -> None:
        """Set a velocity."""
        with self._lock:
            self._speeds[slider] = value

    def stop(self) -> None:
        """Set both velocities to 0."""
        with self._lock:
            self._speeds.update({LINEAR: 0.0, ANGULAR: 0.0})

    def publish(self) -> None:
        """Publish the velocities, unless both are 0 and zeros have already been published."""
        with self._lock:
            linear, angular = self._speeds[LINEAR], self._speeds[ANGULAR]
            is_moving = bool(linear or angular)
            if not is_moving and not self._was_moving:
                return
            self._was_moving = is_moving
        twist = self._twist_class()
        twist.linear.x, twist.angular.z = linear, angular
        self._commands.publish(twist)

    def _end(self) -> None:
        self.stop()
        self.publish()


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `rqt_robot_steering` until the node is shut down."""
    with roscpp_program("rqt_robot_steering", "rqt_robot_steering", argv, anonymous=True) as (node, log):
        try:
            steering = Steering(node)
        except PiprosError as error:
            log.critical("%s", error)
            return 1
        with served_page(steering.page.served_views(), node.name, log):
            while not node.wait_for_shutdown(PERIOD_S):
                steering.publish()
    return 0
