"""A simulated robot with localisation and move_base, in this process and in lockstep, for tests.

Simulated time advances only in methods that wait for something. These methods return, or raise
`WorldFailure`, within the 0.1 s of simulated time in which the outcome is decided. Therefore, a test gives
the same result in each run, on any machine.
"""

from __future__ import annotations

import contextlib
import logging
import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np

from pipros.basics.env import Environment
from pipros.basics.errors import Interrupted
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros_libraries.maps.map_file import Grid, read_map
from pipros_libraries.nodes.frames import Frames
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, serve, subscribe
from pipros_libraries.transforms.errors import TransformException
from pipros_robot.navigation import plane
from pipros_robot.navigation.amcl.amcl_node import AmclNode
from pipros_robot.navigation.move_base.move_base_node import MoveBase
from pipros_robot.navigation.plane import Triple
from pipros_robot.navigation.world_parameters import PARAMETERS, merged
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.obstacle import Obstacle
from pipros_simulation.robots.robots_node import RobotsNode
from pipros_simulation.robots.settings import RobotSettings
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.world import World

START_S: Final = 60.0
WANDER_S: Final = 0.2
"""Interval between commands to a wandering robot."""
ERROR_STEPS: Final = 10
"""Steps between two entries of `NavigationWorld.errors`."""
STEP_S: Final = 60.0
"""Maximum real time without a simulation step."""
STATUSES: Final = ("pending", "active", "preempted", "succeeded", "aborted", "rejected", "preempting")


class WorldFailure(AssertionError):
    """The robot did not do what the test requires."""


class NavigationWorld:
    """A robot on a map. Methods must be called from the test's thread.

    Attributes:
        node: the test's node `/world`, which runs in lockstep.
        simulation: the simulator's robots. Read it only while simulated time stands still.
        errors: localisation errors in metres and radians, recorded five times per simulated second.
    """

    def __init__(
        self,
        master_uri: str,
        map_file: str,
        *,
        start: Triple,
        seed: int = 0,
        robot: RobotSettings | None = None,
        obstacles: Sequence[Obstacle] = (),
        parameters: Mapping[str, Any] | None = None,
    ) -> None:
        """Start the simulator and all nodes. The robot is localised at its start.

        Args:
            map_file: the map's YAML file.
            start: the robot's initial pose: x, y, yaw.
            seed: seed for all noise, including amcl's.
            robot: the robot's settings; defaults to a robot with noisy odometry.
            obstacles: moving obstacles.
            parameters: changes to `PARAMETERS`, by node.
        """
        self._grid = read_map(map_file)
        settings = robot or RobotSettings(odometry_noise=0.05, max_angular=2.0)
        settings = replace(settings, start=Pose(*start))
        world = World.from_grid(self._grid)
        self.simulation = Simulation(world, [settings], seed=seed, obstacles=obstacles)
        self.robot = self.simulation.robots[settings.name]
        self._centres = _wall_centres(world)
        self._resolution = world.resolution
        self._environment = Environment.from_os()._replace(master_uri=master_uri)
        self._changed = threading.Condition()
        self._wanted: Callable[[], bool] | None = None
        self._deadline_s, self._closest_m = 0.0, math.inf
        self._began_s = self._spent_s = 0.0
        self.errors: list[tuple[float, float]] = []
        self._result: Any = None
        self._stack = contextlib.ExitStack()
        self._failures: list[BaseException] = []
        initial = {f"initial_pose_{axis}": value for axis, value in zip("xya", start, strict=True)}
        given = merged(merged(PARAMETERS, {"amcl": {"seed": seed, **initial}}), parameters or {})
        try:
            self._start(given)
        except BaseException:
            self.close()
            raise

    # -- start and end -----------------------------------------------------------

    def _start(self, given: Mapping[str, Any]) -> None:
        self.node = self._new_node("world")
        self.node.params.set("/use_sim_time", True)
        self.node.params.set("/lockstep", ["amcl", "move_base", "world"])
        for name, values in given.items():
            self.node.params.set(f"/{name}", values)
        self.node.use_simulated_time()
        self._serve_map()
        self._frames = Frames(self.node, self.node.log)
        self._goals = advertise(self.node, "move_base_simple/goal", "geometry_msgs/PoseStamped")
        self._commands = advertise(self.node, "cmd_vel", "geometry_msgs/Twist")
        subscribe(self.node, "move_base/result", "move_base_msgs/MoveBaseActionResult", self._on_result, 10)
        Schedule(self.node, self._hold).start()
        sim = self._new_node("sim")
        self._robots = RobotsNode(sim, self.simulation)
        self._robots.observe = self._observe
        for name, make in (("amcl", AmclNode), ("move_base", MoveBase)):
            node = self._new_node(name)
            node.use_simulated_time()
            self._in_thread(partial(self._run, make, node))
        self._in_thread(self._robots.run)
        self._run_until(lambda: self._goals.connection_count > 0, math.inf, START_S)
        self._began_s, self._spent_s = self.time_s, 0.0

    def _new_node(self, name: str) -> Node:
        log = logging.getLogger(f"navigation_world.{name}")
        return self._stack.enter_context(Node(name, environment=self._environment, log=log))

    def _in_thread(self, run: Callable[[], object]) -> None:
        def guarded() -> None:
            try:
                run()
            except Interrupted:
                pass
            except BaseException as error:
                with self._changed:
                    self._failures.append(error)
                    self._changed.notify_all()

        threading.Thread(target=guarded, daemon=True).start()

    @staticmethod
    def _run(make: Callable[..., object], node: Node) -> None:
        schedule = Schedule(node)
        make(node, node.log, schedule)
        schedule.start()

    def _serve_map(self) -> None:
        message = _map_message(self._grid)
        serve(self.node, "static_map", "nav_msgs/GetMap", lambda _: message)
        advertise(self.node, "map", "nav_msgs/OccupancyGrid", latch=True).publish(message)

    def close(self) -> None:
        """Shut down all nodes."""
        self._stack.close()

    @property
    def report(self) -> str:
        """The simulated time, the real time, and their ratio, excluding startup."""
        simulated_s, real_s = self.time_s - self._began_s, self._spent_s
        factor = simulated_s / real_s if real_s else 0.0
        return f"simulated {simulated_s:.1f} s in {real_s:.1f} s: {factor:.1f} times real time"

    # -- the time ----------------------------------------------------------------

    def _hold(self) -> bool:
        """Return whether to stop simulated time, because the test is not waiting for anything.

        Called by the simulator every 0.1 s of simulated time.
        """
        with self._changed:
            if self._is_running():
                if self.simulation.steps % ERROR_STEPS == 0:
                    self.errors.append((self.error_m, self.error_rad))
                return False
            self._changed.notify_all()
            self._changed.wait(0.05)
            return not self._is_running()

    def _observe(self) -> None:
        """Record how close the robot has come to obstacles. Called by the simulator after each step."""
        self._closest_m = min(self._closest_m, self.clearance_m)

    def _is_running(self) -> bool:
        if self._wanted is not None and (self._wanted() or self.time_s >= self._deadline_s):
            self._wanted = None
        return self._wanted is not None

    def _run_until(self, wanted: Callable[[], bool], within_s: float, real_s: float = STEP_S) -> bool:
        """Let simulated time pass until a condition is met, at most `within_s`. Return whether it was met."""
        began_s = time.monotonic()
        with self._changed:
            self._wanted, self._deadline_s = wanted, self.time_s + within_s
            steps, limit_s = -1, 0.0
            while self._wanted is not None and not self._failures:
                if steps != self.simulation.steps:
                    steps, limit_s = self.simulation.steps, time.monotonic() + real_s
                elif time.monotonic() > limit_s:
                    raise WorldFailure(
                        f"simulated time has not advanced for {real_s:g} s; it stopped at {self.time_s:.2f} s"
                    )
                self._changed.wait(0.2)
        self._spent_s += time.monotonic() - began_s
        if self._failures:
            raise self._failures[0]
        return wanted()

    def run_for(self, duration_s: float) -> None:
        """Let some simulated time pass."""
        self._run_until(lambda: False, duration_s)

    # -- state -------------------------------------------------------------------

    @property
    def time_s(self) -> float:
        """The simulated time."""
        return self.simulation.time_s

    @property
    def pose(self) -> Triple:
        """The robot's true pose on the map."""
        return self.robot.pose.x, self.robot.pose.y, self.robot.pose.yaw

    @property
    def estimate(self) -> Triple | None:
        """The robot's pose estimated by amcl, or None before the first estimate."""
        try:
            return plane.flat(self._frames.at("map", "base_footprint", 0))
        except TransformException:
            return None

    @property
    def error_m(self) -> float:
        """The distance between the estimated and the true position."""
        return math.inf if self.estimate is None else math.dist(self.estimate[:2], self.pose[:2])

    @property
    def error_rad(self) -> float:
        """The difference between the estimated and the true yaw."""
        estimate = self.estimate
        return math.inf if estimate is None else abs(math.remainder(estimate[2] - self.pose[2], math.tau))

    @property
    def clearance_m(self) -> float:
        """The distance between the robot and the nearest wall or moving obstacle; 0 if they touch."""
        x, y, radius = self.robot.pose.x, self.robot.pose.y, self.robot.settings.radius
        across = np.abs(self._centres - (x, y)) - self._resolution / 2
        nearest = float(np.hypot(*np.maximum(across, 0.0).T).min(initial=math.inf))
        others = [math.hypot(each.x - x, each.y - y) - each.radius for each in self.simulation.obstacles]
        return 0.0 if self.robot.is_bumped else max(0.0, min([nearest, *others]) - radius)

    def _on_result(self, message: Any) -> None:
        self._result = message.status

    # -- requirements of tests ---------------------------------------------------

    def send_goal(self, x: float, y: float, yaw: float) -> None:
        """Send a goal on the map. Does not wait, so no simulated time passes; see `reaches`."""
        self._result = None
        self._goals.publish(plane.stamped_pose((x, y, yaw), "map", self._robots.stamp()))

    def reaches(
        self,
        x: float,
        y: float,
        yaw: float,
        *,
        within_s: float,
        tolerance_m: float = 0.3,
        tolerance_rad: float = 0.4,
    ) -> None:
        """Send a goal, and let simulated time pass until move_base has reached it.

        Raises:
            WorldFailure: `within_s` has elapsed, move_base gave up, or the robot is not at the goal.
        """
        self.send_goal(x, y, yaw)
        began_s = self.time_s
        has_ended = self._run_until(lambda: self._result is not None, within_s)
        place = f"the robot is at {_text(self.pose)} and {self.clearance_m:.2f} m from an obstacle"
        if not has_ended:
            raise WorldFailure(
                f"the goal {_text((x, y, yaw))} was not reached within {within_s:g} s: {place}"
            )
        if self._result.status != STATUSES.index("succeeded"):
            status = (
                f"{STATUSES[self._result.status]} after {self.time_s - began_s:.1f} s: {self._result.text}"
            )
            raise WorldFailure(f"the goal {_text((x, y, yaw))} was {status}; {place}")
        turn = abs(math.remainder(self.pose[2] - yaw, math.tau))
        if math.dist((x, y), self.pose[:2]) > tolerance_m or turn > tolerance_rad:
            raise WorldFailure(f"move_base reports {_text((x, y, yaw))} as reached, but {place}")

    @contextlib.contextmanager
    def never_closer_than(self, distance_m: float) -> Iterator[None]:
        """Check in each step of a `with` block that the robot keeps a distance from walls and obstacles.

        Raises:
            WorldFailure: the robot came closer. Raised at the end of the block.
        """
        with self._changed:
            self._closest_m = self.clearance_m
        yield
        if self._closest_m < distance_m:
            raise WorldFailure(
                f"the distance to obstacles must be at least {distance_m:g} m, got {self._closest_m:.3f} m"
            )

    def kidnap(self, x: float, y: float, yaw: float) -> None:
        """Move the robot to another place, unnoticed by odometry and localisation."""
        with self._robots.lock:
            self.simulation.place(self.robot.settings.name, Pose(x, y, yaw))

    def localize_globally(self) -> None:
        """Make amcl search for the robot on the whole map."""
        service: Any = load_service_class("std_srvs/Empty")
        self.node.client("global_localization", service).call(service._request_class(), START_S)

    def recovers_from_kidnapping(
        self, x: float, y: float, yaw: float, *, within_s: float, tolerance_m: float = 0.3
    ) -> None:
        """Move the robot to another place, and let it wander until amcl has found it again.

        Wait until the error of the estimate has been less than `tolerance_m` for a second, or `within_s` has
        elapsed.

        Raises:
            WorldFailure: the error is not less than `tolerance_m` at the end.
        """
        self.kidnap(x, y, yaw)
        self.localize_globally()
        end_s, found = self.time_s + within_s, 0
        while found < round(1 / WANDER_S) and self.time_s < end_s:
            self._wander()
            self.run_for(WANDER_S)
            found = found + 1 if self.error_m < tolerance_m else 0
        self._commands.publish(plane.twist((0.0, 0.0, 0.0)))
        self.run_for(WANDER_S)
        if self.error_m >= tolerance_m:
            raise WorldFailure(
                f"the localisation is wrong by {self.error_m:.2f} m, {within_s:g} s after the kidnapping"
            )

    def _wander(self) -> None:
        """Drive forward, or turn if there is an obstacle ahead."""
        with self._robots.lock:
            echoes = self.simulation.echoes(self.robot.settings.name, 120) - self.pose[:2]
        ahead = (np.arctan2(echoes[:, 1], echoes[:, 0]) - self.pose[2] + math.pi) % math.tau - math.pi
        near = np.hypot(*echoes.T)[np.abs(ahead) < 0.7].min(initial=math.inf)
        self._commands.publish(plane.twist((0.4, 0.0, 0.1) if near > 0.7 else (0.0, 0.0, 0.8)))


def _text(pose: Triple) -> str:
    return f"({pose[0]:.2f}, {pose[1]:.2f}, {pose[2]:.2f})"


def _wall_centres(world: World) -> Any:
    """Return the centres of occupied cells, shape (n, 2)."""
    rows, columns = np.nonzero(world.walls)
    half = 0.5 * world.resolution
    x, y = world.left + columns * world.resolution + half, world.bottom + rows * world.resolution + half
    return np.column_stack((x, y))


def _map_message(grid: Grid) -> Any:
    message: Any = load_message_class("nav_msgs/OccupancyGrid")(data=grid.cells)
    message.header.frame_id, message.info.resolution = "map", grid.description.resolution
    message.info.width, message.info.height = grid.width, grid.height
    (message.info.origin,) = plane.pose_messages([grid.description.origin])
    return message
