"""The `sim` program of pipros_sim: runs a simulation described by parameters, with its node and page."""

from __future__ import annotations

import contextlib
import functools
import logging
import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros.node.start_params import is_on
from pipros.safe import yaml
from pipros_libraries.maps.map_file import read_map
from pipros_libraries.nodes.params import raw
from pipros_libraries.robot_model.urdf import read_robot
from pipros_libraries.transforms.pose import IDENTITY, composed, roll_pitch_yaw
from pipros_libraries.transforms.pose import Pose as SpatialPose
from pipros_simulation.robots.battery import BatterySettings
from pipros_simulation.robots.drive import Pose
from pipros_simulation.robots.errors import InvalidSettings
from pipros_simulation.robots.obstacle import Obstacle
from pipros_simulation.robots.robot_endpoints import RobotInterface
from pipros_simulation.robots.robots_node import SIMULATED_ROBOTS, RobotsNode
from pipros_simulation.robots.settings import Imu, Laser, RobotSettings, boolean, changed, number
from pipros_simulation.robots.simulation import Simulation
from pipros_simulation.robots.world import World
from pipros_workspace.index import SHARED_PACKAGES

_USUAL_OBSTACLE = (("radius", 0.2), ("speed", 0.4))
BUILT_IN_MAP = str(SHARED_PACKAGES / "pipros_sim" / "maps" / "room.yaml")


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down. Return 1 if a parameter or the map is invalid."""
    with roscpp_program("sim", "pipros_sim", argv) as (node, log):
        return run(node, log, lambda: _from_parameters(node))


def run(node: Node, log: logging.Logger, make: Any) -> int:
    """Run the simulation that `make` returns, with its page unless the parameter `~headless` is true.

    Return 0, or, if `make` raises a PiprosError, log the error and return 1.
    """
    with contextlib.ExitStack() as stack:
        try:
            robots: RobotsNode = make()
        except PiprosError as error:
            log.error("%s", error)
            return 1
        width, height = robots.simulation.world.size
        count = len(robots.simulation.robots)
        robots_text = "1 robot" if count == 1 else f"{count} robots"
        log.info("Simulating %s in a world of %g x %g m", robots_text, width, height)
        if not is_on(node, "~headless"):
            from pipros_server.node_page import served_page
            from pipros_simulation.robots.sim_page import SimPage

            stack.enter_context(served_page(SimPage(robots, node).served_views(), node.name, log))
        robots.run()
    return 0


def _from_parameters(node: Node) -> RobotsNode:
    """Create the simulation that the private parameters describe; docs/guides/simulation.md lists them."""

    get = functools.partial(_given, node)
    seed = number(get("seed", 0), "seed")
    speed = number(get("speed", 1.0), "speed")
    if seed < 0 or speed <= 0:
        raise InvalidSettings(f"seed must be >= 0 and speed > 0, got {seed:g} and {speed:g}")
    names = _names(node)
    robot = changed(RobotSettings(), get("robot", {}), "robot")
    robot = replace(
        robot,
        laser=_laser(node, names),
        imu=changed(Imu(), get("imu", {}), "imu"),
        battery=changed(BatterySettings(), get("battery", {}), "battery"),
    )
    world = World.from_grid(read_map(str(get("map", "") or BUILT_IN_MAP)))
    limit = SIMULATED_ROBOTS
    robots = robots_of(get("robots", 1), robot, limit)
    obstacles = obstacles_of(get("obstacles", []), limit)
    simulation = Simulation(world, robots, seed=int(seed), obstacles=obstacles)
    controllers = str(get("controllers", ""))
    return RobotsNode(node, simulation, names=names, speed=speed, controllers=controllers)


def _given(node: Node, name: str, default: Any) -> Any:
    """Return a parameter. A text in the place of a list, mapping or number is YAML, as arguments of launch
    files are.
    """
    value = raw(node, name, default)
    if not isinstance(value, str) or isinstance(default, str):
        return value
    try:
        return yaml.load(value, name)
    except yaml.YamlError as error:
        raise InvalidSettings(f"{name} must be YAML: {error}") from None


def _names(node: Node) -> RobotInterface:
    usual = RobotInterface()
    frames: dict[str, Any] = {
        key: str(raw(node, key, getattr(usual, key))) for key in ("odom_frame", "scan_frame", "imu_frame")
    }
    base = str(raw(node, "base_frame", usual.base_frames[0]))
    return replace(
        usual,
        **frames,
        wheel_joints=_wheels(_given(node, "wheel_joints", list(usual.wheel_joints))),
        base_frames=tuple(dict.fromkeys((base, base[: base.rfind("/") + 1] + usual.base_frames[1]))),
        has_tf=boolean(raw(node, "publish_tf", True), "publish_tf"),
        has_static_tf=boolean(raw(node, "publish_static_tf", True), "publish_static_tf"),
    )


def _wheels(given: object) -> tuple[str, str]:
    if not isinstance(given, list) or len(given) != 2 or not all(isinstance(each, str) for each in given):
        raise InvalidSettings(f"wheel_joints must be a list of two names, left and right, got {given!r}")
    return given[0], given[1]


def _laser(node: Node, names: RobotInterface) -> Laser:
    """Return the laser, at its pose in the robot description unless the parameter `laser` has a pose."""
    given = _given(node, "laser", {})
    laser = changed(Laser(), given, "laser")
    if given.keys() & {"x", "y", "z", "yaw"} or not node.params.has("robot_description"):
        return laser
    return placed_laser(laser, str(node.params.get("robot_description")), names.scan_frame, names.base_frames)


def robots_of(given: object, usual: RobotSettings, limit: int) -> list[RobotSettings]:
    """Parse the parameter `robots`: a number, or a list of mappings with name, x, y and yaw.

    Raises:
        InvalidSettings: the value is neither, or there are more than `limit` robots.
    """
    if isinstance(given, list):
        if not 0 < len(given) <= limit:
            raise InvalidSettings(f"robots must be a list of 1 to {limit} robots, got {len(given)}")
        return [_robot_of(each, usual) for each in given]
    count = number(given, "robots")
    if not (count.is_integer() and 1 <= count <= limit):
        raise InvalidSettings(f"robots must be a number from 1 to {limit}, or a list, got {given!r}")
    if count == 1:
        return [usual]
    return [replace(usual, name=f"robot_{index}") for index in range(int(count))]


def obstacles_of(given: object, limit: int) -> list[Obstacle]:
    """Parse the parameter `obstacles`: a list of mappings with points, radius and speed.

    Raises:
        InvalidSettings: the value is anything else, or there are more than `limit` obstacles.
    """
    if not isinstance(given, list) or len(given) > limit:
        raise InvalidSettings(f"obstacles must be a list of at most {limit} mappings, got {given!r}")
    found = []
    for each in given:
        if not isinstance(each, dict) or not {"points"} <= each.keys() <= {"points", "radius", "speed"}:
            raise InvalidSettings(
                f"an obstacle must be a mapping with points, and optionally radius and speed, got {each!r}"
            )
        points = each["points"]
        if not isinstance(points, list) or not all(isinstance(p, list) and len(p) == 2 for p in points):
            raise InvalidSettings(f"obstacles/points must be a list of [x, y], got {points!r}")
        places = [(number(x, "obstacles/points"), number(y, "obstacles/points")) for x, y in points]
        radius, speed = (number(each.get(key, usual), f"obstacles/{key}") for key, usual in _USUAL_OBSTACLE)
        found.append(Obstacle(places, radius, speed))
    return found


def _robot_of(given: object, usual: RobotSettings) -> RobotSettings:
    from pipros.basics import names

    if not isinstance(given, dict) or not given.keys() <= {"name", "x", "y", "yaw"}:
        raise InvalidSettings(f"each robot must be a mapping of name, x, y and yaw only, got {given!r}")
    name = given.get("name", "")
    if not isinstance(name, str) or (name and not names.is_legal_base(name)):
        raise InvalidSettings(
            f"a robot's name must begin with a letter and contain only letters, digits and _, got {name!r}"
        )
    if "x" not in given and "y" not in given:
        return replace(usual, name=name)
    x, y, yaw = (number(given.get(key, 0.0), f"robots/{key}") for key in ("x", "y", "yaw"))
    return replace(usual, name=name, start=Pose(x, y, math.remainder(yaw, math.tau)))


def placed_laser(laser: Laser, description: str, frame: str, bases: Collection[str]) -> Laser:
    """Return the laser at its pose in a robot description, or unchanged if the description lacks its frame.

    A laser that is mounted upside down measures clockwise. Any other inclination is ignored.

    Raises:
        UrdfError: the description is invalid.
    """
    pose = pose_of(description, frame, bases)
    if pose is None:
        return laser
    x, y, z = pose[:3]
    roll, _, yaw = roll_pitch_yaw(pose)
    is_upside_down = abs(roll) > math.pi / 2
    return replace(laser, x=x, y=y, z=z, yaw=yaw, is_upside_down=is_upside_down)


def pose_of(description: str, frame: str, bases: Collection[str]) -> SpatialPose | None:
    """Return a link's pose relative to the closest of the links `bases` above it, or to the root.

    All joints are at 0. Return None if no joint moves the link.

    Raises:
        UrdfError: the description is invalid.
    """
    parents = {joint.child: joint for joint in read_robot(description).joints}
    if frame not in parents:
        return None
    pose = IDENTITY
    while frame in parents and frame not in bases:
        pose = composed(parents[frame].origin, pose)
        frame = parents[frame].parent
    return pose
