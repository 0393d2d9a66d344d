"""`rqt_robot_steering`: sliders for a robot's linear and angular velocity, by default on `/cmd_vel`."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import raw
from pipros_libraries.nodes.velocities import SILENCE_S, VelocityOutput, check_axis, checked_number
from pipros_server.node_page import served_page
from pipros_server.sliders.slider_page import Slider, SliderPage

PERIOD_S: Final = 0.1
LINEAR, ANGULAR = "linear", "angular"
FASTEST: Final = 3.0
"""Default maximum of both sliders, in m/s and rad/s."""


class Steering:
    """Velocities set with sliders. Call `publish` periodically to publish them.

    The robot stops when a browser leaves the page or is silent for `SILENCE_S`, and when the node ends.
    """

    def __init__(self, node: Node, clock_s: Callable[[], float] = time.monotonic) -> None:
        """Read the parameters `~default_topic`, `~default_vx_max`, `~default_vw_min` and so on.

        Raises:
            InvalidName: the topic's name is not legal.
            InvalidParameter: a bound is not finite, or a maximum is below its minimum.
        """
        self._lock = threading.Lock()
        self._speeds = {LINEAR: 0.0, ANGULAR: 0.0}
        self._clock_s, self._held_s = clock_s, -math.inf
        self._ranges = {
            kind: (
                checked_number(node, f"default_{short}_min", -FASTEST, least=-math.inf),
                checked_number(node, f"default_{short}_max", FASTEST, least=-math.inf),
            )
            for kind, short in ((LINEAR, "vx"), (ANGULAR, "vw"))
        }
        for short, (low, high) in zip(("vx", "vw"), self._ranges.values(), strict=True):
            check_axis((f"~default_{short}_min", low), (f"~default_{short}_max", high))
        topic = str(raw(node, "default_topic", "/cmd_vel"))
        self._commands = VelocityOutput(node, topic)
        self.page = SliderPage(
            f"Steering {node.resolve(topic)}",
            node.name,
            self.sliders,
            self.move,
            {"Stop": self.stop},
            on_left=self.stop,
            on_held=self.hold,
        )

    def sliders(self) -> list[Slider]:
        """Return both sliders."""
        units = {LINEAR: "m/s", ANGULAR: "rad/s"}
        return [Slider(kind, *self._ranges[kind], self._speeds[kind], units[kind]) for kind in units]

    def move(self, slider: str, value: float) -> None:
        """Set a velocity."""
        with self._lock:
            self._speeds[slider], self._held_s = value, self._clock_s()

    def hold(self) -> None:
        """Keep both velocities for another `SILENCE_S`."""
        self._held_s = self._clock_s()

    def stop(self) -> None:
        """Set both velocities to 0."""
        with self._lock:
            self._speeds.update({LINEAR: 0.0, ANGULAR: 0.0})

    def publish(self) -> None:
        """Publish the velocities, unless both are 0 and zeros have already been published."""
        if self._clock_s() - self._held_s >= SILENCE_S:
            self.stop()
        twist = self._commands.message()
        with self._lock:
            twist.linear.x, twist.angular.z = self._speeds[LINEAR], self._speeds[ANGULAR]
        if twist.linear.x or twist.angular.z:
            self._commands.publish(twist)
        else:
            self._commands.stop()


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
