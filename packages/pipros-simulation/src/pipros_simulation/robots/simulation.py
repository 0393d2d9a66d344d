"""Robots in a world, step by step in simulated time. This module reads no clock and performs no I/O.

The same settings, seed and commands (at the same steps) produce the same trace, whichever scans are
requested.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipros_simulation.robots.drive import Pose, combined, moved
from pipros_simulation.robots.errors import InvalidSettings, Rejected
from pipros_simulation.robots.obstacle import Obstacle
from pipros_simulation.robots.ray_casting import cast_rays, distances_to_discs
from pipros_simulation.robots.robot import SimulatedRobot
from pipros_simulation.robots.settings import Laser, RobotSettings
from pipros_simulation.robots.world import World

Ranges = NDArray[np.float64]

STEP_S: Final = 0.02
"""Simulated time of a step."""
POLITE_M: Final = 0.1
"""Distance to a robot at which a moving obstacle waits."""
_ATTEMPTS: Final = 1000


class Simulation:
    """A world and its robots. Not thread-safe.

    Attributes:
        world: the walls.
        robots: the robots by name, in the order of the settings.
        obstacles: the moving obstacles.
        steps: number of steps so far.
    """

    def __init__(
        self,
        world: World,
        robots: Sequence[RobotSettings],
        *,
        seed: int = 0,
        obstacles: Sequence[Obstacle] = (),
    ) -> None:
        """Create a simulation.

        Args:
            seed: a seed >= 0 for the noise and for the random poses of robots without a starting pose.

        Raises:
            InvalidSettings: a name is repeated, a starting pose is too close to a wall or to the map's edge,
                or no free place was found for a robot.
        """
        self.world = world
        self.obstacles = list(obstacles)
        self.robots: dict[str, SimulatedRobot] = {}
        self.steps = 0
        self._reset_at = 0
        places, *seeds = np.random.SeedSequence(seed).spawn(len(robots) + 1)
        random = np.random.default_rng(places)
        for settings in robots:
            if settings.start is not None and not world.is_free(
                settings.start.x, settings.start.y, settings.radius
            ):
                raise InvalidSettings(
                    f"robot [{settings.name}] cannot start at {settings.start}: "
                    "too close to a wall or to the map's edge"
                )
        for settings, robot_seed in zip(robots, seeds, strict=True):
            if settings.name in self.robots:
                raise InvalidSettings(f"robot names must be unique, got [{settings.name}] twice")
            start = settings.start or self._free_place(settings, robots, random)
            self.robots[settings.name] = SimulatedRobot(settings, start, robot_seed)

    def _free_place(
        self, settings: RobotSettings, all_robots: Sequence[RobotSettings], random: np.random.Generator
    ) -> Pose:
        """Return the origin of the map if it is free of walls and robots, otherwise a random free place."""
        taken = [(robot.pose, robot.settings.radius) for robot in self.robots.values()]
        taken += [(robot.start, robot.radius) for robot in all_robots if robot.start is not None]
        cells = self.world.free_cells()
        for attempt in range(_ATTEMPTS if len(cells) else 0):
            x, y = (0.0, 0.0) if not attempt else map(float, cells[random.integers(len(cells))])
            if self.world.is_free(x, y, settings.radius) and all(
                math.hypot(pose.x - x, pose.y - y) > radius + settings.radius for pose, radius in taken
            ):
                return Pose(x, y, 0.0)
        raise InvalidSettings(f"no free place found for robot [{settings.name}] (radius {settings.radius} m)")

    @property
    def time_s(self) -> float:
        """The simulated time in seconds since the start."""
        return self.steps * STEP_S

    def step(self) -> None:
        """Move all robots, then all obstacles, one after the other, by one step of `STEP_S`."""
        self.steps += 1
        for robot in self.robots.values():
            motion = robot.planned(self.time_s, STEP_S)
            ground = robot.on_ground(motion, self.time_s)
            has_moved = bool(ground.forwards or ground.sideways)
            is_blocked = has_moved and self._is_blocked(robot, moved(robot.pose, ground))
            robot.step(motion, ground, STEP_S, is_blocked=is_blocked)
        for obstacle in self.obstacles:
            obstacle.step(STEP_S, partial(self._is_in_nobodys_way, obstacle))

    def _is_blocked(self, robot: SimulatedRobot, pose: Pose) -> bool:
        """Return True if a robot must not move to `pose`.

        A robot may touch neither a wall nor an obstacle, and may only move away from a robot that it touches.
        """
        if not self.world.is_free(pose.x, pose.y, robot.settings.radius):
            return True
        for other in self.robots.values():
            if other is not robot:
                far = math.hypot(pose.x - other.pose.x, pose.y - other.pose.y)
                if far < robot.settings.radius + other.settings.radius:
                    before = math.hypot(robot.pose.x - other.pose.x, robot.pose.y - other.pose.y)
                    if far <= before:
                        return True
        return any(
            math.hypot(pose.x - each.x, pose.y - each.y) < robot.settings.radius + each.radius
            for each in self.obstacles
        )

    def _is_in_nobodys_way(self, obstacle: Obstacle, x: float, y: float, radius: float) -> bool:
        """Return whether an obstacle may move to a place: it must not come closer to robots that are near."""
        for robot in self.robots.values():
            far = math.hypot(robot.pose.x - x, robot.pose.y - y)
            before = math.hypot(robot.pose.x - obstacle.x, robot.pose.y - obstacle.y)
            if far <= robot.settings.radius + radius + POLITE_M and far < before:
                return False
        return True

    def scans(self, names: Collection[str]) -> dict[str, Ranges]:
        """Return the ranges, in metres, that the lasers of these robots measure now, by robot name.

        Robots without a laser are omitted.
        """
        scanning = [
            (name, self.robots[name], laser)
            for name in names
            if (laser := self.robots[name].settings.laser) is not None
        ]
        if not scanning:
            return {}
        poses = [combined(robot.pose, laser.pose) for _, robot, laser in scanning]
        angles = [pose.yaw + _directions(laser) for pose, (*_, laser) in zip(poses, scanning, strict=True)]
        counts = [laser.rays for *_, laser in scanning]
        walls = cast_rays(
            self.world,
            np.repeat([pose.x for pose in poses], counts),
            np.repeat([pose.y for pose in poses], counts),
            np.concatenate(angles),
            np.repeat([laser.range_max for *_, laser in scanning], counts),
        )
        parts = np.split(walls, np.cumsum(counts)[:-1])
        measured = {}
        for (name, robot, laser), pose, angle, ranges in zip(scanning, poses, angles, parts, strict=True):
            nearest = np.minimum(ranges, distances_to_discs(pose.x, pose.y, angle, self._discs_beside(robot)))
            measured[name] = _measured(nearest, laser, robot.noise(self.steps - self._reset_at))
        return measured

    def echoes(self, name: str, max_rays: int) -> NDArray[np.float64]:
        """Return the points that up to `max_rays` rays of a robot's laser hit, without noise.

        The array has the shape (n, 2), and contains x and y in the map frame.
        """
        robot = self.robots[name]
        laser = robot.settings.laser
        if laser is None:
            return np.empty((0, 2))
        pose = combined(robot.pose, laser.pose)
        angle = pose.yaw + _directions(laser)
        angle = angle[:: -(-laser.rays // max_rays)]
        everywhere = np.ones(angle.shape)
        ranges = cast_rays(
            self.world, pose.x * everywhere, pose.y * everywhere, angle, laser.range_max * everywhere
        )
        ranges = np.minimum(ranges, distances_to_discs(pose.x, pose.y, angle, self._discs_beside(robot)))
        points = np.column_stack((pose.x + ranges * np.cos(angle), pose.y + ranges * np.sin(angle)))
        return points[ranges <= laser.range_max]

    def _discs_beside(self, robot: SimulatedRobot) -> NDArray[np.float64]:
        """Return x, y and radius of all other robots and obstacles as an array of shape (n, 3)."""
        others = [
            (other.pose.x, other.pose.y, other.settings.radius)
            for other in self.robots.values()
            if other is not robot
        ]
        others += [(each.x, each.y, each.radius) for each in self.obstacles]
        return np.array(others or np.empty((0, 3)), np.float64)

    def place(self, name: str, pose: Pose) -> None:
        """Move a robot to a pose.

        Raises:
            Rejected: no robot has this name, the pose is not finite, or the place is not free.
        """
        robot = self.robots.get(name)
        if robot is None:
            raise Rejected(f"robot [{name}] does not exist; the robots are {', '.join(self.robots)}")
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            raise Rejected(f"the pose must contain only finite numbers, got {pose}")
        if not self.world.is_free(pose.x, pose.y, robot.settings.radius):
            raise Rejected(f"a wall or the map's edge is too close to x={pose.x:.2f}, y={pose.y:.2f}")
        for other_name, other in self.robots.items():
            reach = robot.settings.radius + other.settings.radius
            if other is not robot and math.hypot(pose.x - other.pose.x, pose.y - other.pose.y) < reach:
                raise Rejected(f"robot [{other_name}] is too close to x={pose.x:.2f}, y={pose.y:.2f}")
        for each in self.obstacles:
            if math.hypot(pose.x - each.x, pose.y - each.y) < robot.settings.radius + each.radius:
                raise Rejected(f"a moving obstacle is too close to x={pose.x:.2f}, y={pose.y:.2f}")
        robot.place(pose)

    def reset(self) -> None:
        """Move all robots and obstacles back to their starting poses.

        Recharge the robots' batteries and restart their noise sequences. Simulated time continues.
        """
        self._reset_at = self.steps
        for robot in self.robots.values():
            robot.reset()
        for obstacle in self.obstacles:
            obstacle.reset()


def _directions(laser: Laser) -> NDArray[np.float64]:
    """Return the directions of the rays relative to the laser, counter-clockwise from above, in radians."""
    angles = laser.min_angle + laser.increment * np.arange(laser.rays, dtype=np.float64)
    return -angles if laser.is_upside_down else angles


def _measured(exact: Ranges, laser: Laser, random: np.random.Generator) -> Ranges:
    """Return the ranges with noise added. Ranges outside the laser's limits become `laser.no_echo`."""
    if laser.noise:
        exact = exact + laser.noise * random.standard_normal(exact.shape)
    is_echo = (exact >= laser.range_min) & (exact <= laser.range_max)
    return np.where(is_echo, exact, laser.no_echo)
