"""The node for simulated robots: runs a `Simulation` and connects it to topics and services."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros.node.start_params import is_on
from pipros_simulation.robots.controller_manager import ControllerManager
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.lockstep import Lockstep, members
from pipros_simulation.robots.robot_endpoints import RobotEndpoints, RobotInterface, serve
from pipros_simulation.robots.simulation import STEP_S, Simulation

SIMULATED_ROBOTS = 100
"""Maximum number of robots, and of moving obstacles, in one simulation. Beyond it, the simulation ends with
an error.
"""

SCAN_STEPS: Final = 5
"""Steps between two scans: 10 Hz."""
BATTERY_STEPS: Final = 50
"""Steps between two battery messages: 1 Hz."""
START_STEPS: Final = 200
"""The lockstep begins at a multiple of this number of steps: 4 s."""
SLOW_S: Final = 0.5
"""Real duration of a step in the last second before each such multiple, while members are missing."""
LATE_S: Final = 0.1
"""If the simulation is behind by more than this, it skips the missed steps."""

_STEP_NS: Final = round(STEP_S * 1e9)


class RobotsNode:
    """A ROS node that runs a simulation of robots.

    If `/use_sim_time` is true, the node publishes its simulated time on `/clock` and in timestamps; otherwise
    timestamps are wall time. Service handlers and commands run in threads.

    Attributes:
        lock: held while the simulation is used.
        simulation: the robots.
        observe: called after each step, with the lock held.
    """

    def __init__(
        self,
        node: Node,
        simulation: Simulation,
        *,
        names: RobotInterface | None = None,
        speed: float = 1.0,
        controllers: str = "",
    ) -> None:
        """Register all topics and services.

        Args:
            names: names of frames and topics, before each robot's name is added as a prefix.
            speed: simulated seconds per second of wall time.
            controllers: namespace of the controller manager that has the robot's base; empty if none has.

        Raises:
            InvalidSettings: there are too many robots, `/lockstep` is invalid, or `speed` is not 1 without
                simulated time.
        """
        limit = SIMULATED_ROBOTS
        if len(simulation.robots) > limit:
            raise InvalidSettings(f"too many robots: the limit is {limit}")
        self._has_clock = is_on(node, "/use_sim_time")
        if speed != 1.0 and not self._has_clock:
            raise InvalidSettings(f"speed {speed} needs simulated time: set /use_sim_time to true first")
        self.lock = threading.Lock()
        self.simulation = simulation
        self._node = node
        self.observe: Callable[[], object] = lambda: None
        self._lockstep = Lockstep(node, members(node) if self._has_clock else [], node.log)
        self._interval_s = STEP_S / speed
        self._tf_class: Any = load_message_class("tf2_msgs/TFMessage")
        self._names = names or RobotInterface()
        if controllers:
            self._names = replace(self._names, has_base=False, has_tf=False)
        self._tf = node.advertise("/tf", self._tf_class, queue_size=100) if self._names.has_tf else None
        if self._has_clock:
            self._clock_class: Any = load_message_class("rosgraph_msgs/Clock")
            self._clock = node.advertise("/clock", self._clock_class, queue_size=1)
        self._endpoints = {
            name: RobotEndpoints(node, name, simulation, self.lock, self._names.of(name))
            for name in simulation.robots
        }
        self._manager: ControllerManager | None = None
        if controllers:
            wheels = self._names.wheel_joints
            self._manager = ControllerManager(node, controllers, simulation, self.lock, wheels)
        if self._names.has_static_tf:
            static = node.advertise("/tf_static", self._tf_class, queue_size=10, latch=True)
            stamp, every = self.stamp(), self._endpoints.values()
            fixed = [each for endpoints in every for each in endpoints.fixed_transforms(stamp)]
            static.publish(self._tf_class(fixed))
        serve(node, "reset_positions", "std_srvs/Empty", self._reset)

    def run(self) -> None:
        """Run until the node is shut down: in lockstep while there are members, otherwise at `speed`."""
        if self._lockstep.has_members:
            self._run_in_lockstep()
        due_s = time.monotonic()
        while not self._node.wait_for_shutdown(max(0.0, due_s - time.monotonic())):
            self.step()
            due_s += self._interval_s
            if time.monotonic() - due_s > LATE_S:
                due_s = time.monotonic()

    def _run_in_lockstep(self) -> None:
        """Run as fast as the members answer, until the node is shut down or no member is left."""
        lockstep = self._lockstep
        try:
            if not self._wait_for_members():
                return
            while lockstep.has_members and not self._node.is_ending:
                has_scans = self.simulation.steps % SCAN_STEPS == 0
                if not lockstep.settle(self.stamp(), has_scans=has_scans):
                    self.step()
                    lockstep.count(STEP_S)
            lockstep.report()
        finally:
            lockstep.close()

    def _wait_for_members(self) -> bool:
        """Advance the time without moving anything until all members are ready. Return False at shutdown.

        Time must advance, because starting nodes wait for transforms. The lockstep begins at a multiple of
        `START_STEPS`, so that timestamps are repeatable: at the first multiple unless a member starts very
        slowly. After the first multiple, the members that are ready do their work, because the others may
        wait for their transforms, such as those of a filter.
        """
        missing = [""]
        while missing or self.simulation.steps % START_STEPS:
            phase = self.simulation.steps % START_STEPS
            if missing and phase % SCAN_STEPS == 0:
                before, missing = missing, self._lockstep.missing()
                if missing and missing != before:
                    self._node.log.info("the lockstep begins when there is %s", " and ".join(missing))
            pause_s = 0.0 if not missing else STEP_S if phase < START_STEPS - 50 else SLOW_S
            if self._node.wait_for_shutdown(pause_s):
                return False
            with self.lock:
                self.simulation.step()
                self.simulation.reset()
            self._publish()
            if missing and self.simulation.steps > START_STEPS and self.simulation.steps % SCAN_STEPS == 0:
                self._lockstep.settle(self.stamp(), has_scans=True)
        return True

    def step(self) -> None:
        """Move the robots and publish their measurements."""
        with self.lock:
            if self._manager is not None:
                self._manager.update()
            self.simulation.step()
            self.observe()
        self._publish()

    def _publish(self) -> None:
        with self.lock:
            steps = self.simulation.steps
            wanted = [name for name, endpoints in self._endpoints.items() if endpoints.wants_scan]
            scans = self.simulation.scans(wanted if steps % SCAN_STEPS == 0 else ())
            stamp = self.stamp()
            if self._has_clock:
                self._clock.publish(self._clock_class(stamp))
            if self._tf is not None and self._tf.connection_count:
                self._tf.publish(
                    self._tf_class([endpoints.transform(stamp) for endpoints in self._endpoints.values()])
                )
            if self._manager is not None:
                self._manager.publish(stamp)
            for name, endpoints in self._endpoints.items():
                endpoints.publish_motion(stamp)
                if name in scans:
                    endpoints.publish_scan(stamp, scans[name], SCAN_STEPS * STEP_S)
                if steps % BATTERY_STEPS == 0:
                    endpoints.publish_battery(stamp)

    def stamp(self) -> Time:
        """Return the current time for timestamps: simulated time or, without `/clock`, wall time."""
        if not self._has_clock:
            return Time(*divmod(time.time_ns(), 1_000_000_000))
        return Time(*divmod(self.simulation.steps * _STEP_NS, 1_000_000_000))

    def _reset(self, _: Any) -> None:
        with self.lock:
            self.simulation.reset()
