"""The robot that a launch file expects: its topics, frames, size and place."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.plugin_table import why_no_package
from pipros.basics.plugins import offered
from pipros.packages.nodelets import package_of
from pipros_libraries.nodes.velocities import least_turning_radius
from pipros_libraries.robot_model.urdf import Robot, UrdfError, read_robot
from pipros_simulation.launch_sets.footprints import free_pose, inner_radius, is_number
from pipros_simulation.launch_sets.joints import moved_joints, wheel_joints
from pipros_simulation.launch_sets.node_topics import FILTERS, NodeView, params_below, views_of
from pipros_tools.launch.load_context import NotRun
from pipros_tools.launch.model import Launch

ONLY_XACRO: Final = "its command is not run, because only xacro and cat are"
LASER_HEIGHT_M: Final = 0.2
FASTER: Final = 1.5
"""The simulated robot can drive faster than planners may, so that one that does is noticed."""
_SIMULATED: Final = {
    "scan": "scan",
    "odom": "odom",
    "cmd_vel": "cmd_vel",
    "imu": "imu",
    "joints": "joint_states",
    "true pose": "base_pose_ground_truth",
}
"""Topics of pipros_sim by the kind of data."""
_MAPPERS: Final = ("gmapping/slam_gmapping", "hector_mapping/hector_mapping")
_LOCALIZERS: Final = (*_MAPPERS, "amcl/amcl", "fake_localization/fake_localization")
_STATIC: Final = ("tf/static_transform_publisher", "tf2_ros/static_transform_publisher")
_JOINT_PUBLISHERS: Final = (
    "joint_state_publisher/joint_state_publisher",
    "joint_state_publisher_gui/joint_state_publisher_gui",
)
_LASER_WORDS: Final = ("laser", "scan", "lidar", "hokuyo", "sick", "rplidar", "velodyne")


@dataclass
class Expected:
    """What a launch file expects from the robot.

    Attributes:
        topics: full names of topics by pipros_sim's names.
        params: parameters of pipros_sim.
        overrides: parameters that must differ from those in the launch file, by full name.
        notes: where the values come from.
        unknown: what could not be found out, with the value that is used instead.
    """

    topics: dict[str, str] = field(default_factory=dict)
    params: dict[str, Any] = field(default_factory=dict)
    overrides: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)


def expected_robot(launch: Launch) -> Expected:
    """Return what the nodes of a launch file expect from the robot."""
    reader = _Reader(launch)
    for find in (
        reader.controllers,
        reader.topics,
        reader.frames,
        reader.laser,
        reader.size,
        reader.place,
        reader.localization,
        reader.others,
    ):
        find()
    return reader.found


class _Reader:
    def __init__(self, launch: Launch) -> None:
        self.found = Expected()
        self._launch = launch
        self._views = views_of(launch)
        self._reads = [(*each, view) for view in self._views for each in view.reads()]
        self._writes = [(*each, view) for view in self._views for each in view.writes()]
        self._robot = self._description()
        self._links = [] if self._robot is None else list(self._robot.links)
        self._drives: list[dict[str, Any]] = []

    def _of(self, *kinds: str) -> Iterator[NodeView]:
        return (view for view in self._views if view.kind in kinds)

    def _description(self) -> Robot | None:
        for key, value in self._launch.params.items():
            if key.rpartition("/")[2] != "robot_description":
                continue
            if isinstance(value, NotRun):
                fails = "its command fails, and so will roslaunch"
                self.found.unknown.append(f"{key}: {value if value == ONLY_XACRO else fails}")
                continue
            try:
                return read_robot(str(value))
            except UrdfError as error:
                self.found.unknown.append(f"{key}: {error}")
        return None

    # -- topics ----------------------------------------------------------------------

    def controllers(self) -> None:
        """Find the controllers that spawners load; a diff_drive_controller has the robot's topics.

        Without one, the robot has its own topics, because nothing else would move it.
        """
        joints = []
        for view in (spawners := list(self._of("controller_manager/spawner"))):
            for name in view.words():
                prefix = names.join(view.node.namespace, name)
                params = params_below(self._launch, prefix + "/")
                kind = str(params.get("type", ""))
                if kind.endswith("DiffDriveController"):
                    self._drives.append(params)
                    self._reads.append(("cmd_vel", f"{prefix}/cmd_vel", view))
                    self._writes.append(("odom", f"{prefix}/odom", view))
                elif kind.endswith("JointStateController"):
                    joints.append(("joints", view.topic("joint_states"), view))
                else:
                    self.found.unknown.append(
                        f"controller [{prefix}] ({kind or 'without a type'}) is not simulated"
                    )
        who = ", ".join(view.node.full_name for view in spawners)
        if self._drives:
            self._writes += joints
            self.found.params["controllers"] = spawners[-1].node.namespace
            self.found.notes.append(f"controllers: {who} loads them")
        elif spawners:
            self.found.unknown.append(
                f"a controller of {who} that moves the base: the robot takes velocities on its own cmd_vel, "
                "and has no controller manager; leave the spawner out"
            )

    def topics(self) -> None:
        """Find the topics that the nodes read and no node writes, and the commands that no node reads."""
        written = {topic for _, topic, _ in self._writes}
        wanted = Counter((kind, topic) for kind, topic, _ in self._reads if topic not in written)
        for kind, name in _SIMULATED.items():
            if kind == "cmd_vel":
                continue
            topics = [topic for (each, topic), _ in wanted.most_common() if each == kind]
            self._choose(name, kind, topics, "no node writes it")
        for (kind, topic), _ in wanted.items():
            if kind not in (*_SIMULATED, "any"):
                self.found.unknown.append(f"who publishes {topic} ({kind}); the simulated robot does not")
        relayed = [topic for (kind, topic) in wanted if kind == "any"]
        if relayed:
            self.found.unknown.append(f"what topic_tools relays from {', '.join(relayed)}")
        read = {topic for kind, topic, _ in self._reads if kind in ("cmd_vel", "any")}
        commands = dict.fromkeys(
            topic for kind, topic, _ in self._writes if kind == "cmd_vel" and topic not in read
        )
        self._choose("cmd_vel", "cmd_vel", list(commands), "no node reads it")

    def _choose(self, name: str, kind: str, topics: Sequence[str], why: str) -> None:
        if topics:
            self.found.topics[name] = topics[0]
            users = [
                view.node.full_name for _, topic, view in (*self._reads, *self._writes) if topic == topics[0]
            ]
            self.found.notes.append(f"{name}: {', '.join(dict.fromkeys(users))} on {topics[0]}; {why}")
        elif name == "scan" or (name in ("odom", "cmd_vel") and not self._drives):
            self.found.unknown.append(f"the topic of {name}: no known node needs it; it stays /{name}")
        for topic in topics[1:]:
            self.found.unknown.append(f"a second {kind} topic, {topic}: the simulated robot has one")

    # -- frames ----------------------------------------------------------------------

    def frames(self) -> None:
        """Find the frames of the robot, and who publishes their transforms."""
        for view in self._views:
            for topic in ("/tf", "/tf_static"):
                if view.topic(topic) != topic:
                    self.found.topics[topic] = view.topic(topic)
        self._frame("odom_frame", "odom", self._odom_frames())
        bases = self._base_frames()
        publishers = list(self._of("robot_state_publisher/robot_state_publisher"))
        if self._robot is not None and publishers:
            self.found.params["publish_static_tf"] = False
            self.found.notes.append(f"publish_static_tf: {publishers[0].node.full_name} publishes the URDF")
            self._frame("base_frame", "", [self._robot.root])
            self._wheels(self._robot)
        else:
            usual = [each for each in bases if each == "base_footprint"]
            self._frame("base_frame", "base_footprint", [*usual, *bases])
            known = {self.found.params["base_frame"], f"{self._prefix()}base_link", *self._static()}
            for each in dict.fromkeys(bases):
                if each not in known:
                    self.found.unknown.append(f"who publishes the frame {each}")
        self._who_moves_the_base()

    def _wheels(self, robot: Robot) -> None:
        if wheels := wheel_joints(robot):
            self.found.params["wheel_joints"] = wheels
        others = moved_joints(robot, wheels)
        if others and not self._drives and not any(self._of(*_JOINT_PUBLISHERS)):
            self.found.unknown.append(
                f"who publishes the joints {', '.join(others)}, without which their links have no "
                "transforms; joint_state_publisher can"
            )

    def _who_moves_the_base(self) -> None:
        odom = self.found.params["odom_frame"]
        for view in self._of(*FILTERS):
            world = view.frame("world_frame", view.frame("odom_frame", "odom"))
            if view.params.get("publish_tf", True) and world == odom:
                self.found.params["publish_tf"] = False
                self.found.notes.append(f"publish_tf: {view.node.full_name} publishes {odom} to the base")
        if any(self._of("robot_pose_ekf/robot_pose_ekf", "laser_scan_matcher/laser_scan_matcher_node")):
            self.found.params["publish_tf"] = False

    def _frame(self, name: str, default: str, frames: Iterable[str]) -> None:
        distinct = [each for each in dict.fromkeys(frames) if each]
        self.found.params[name] = distinct[0] if distinct else default
        if not distinct:
            self.found.unknown.append(f"{name}: no known node names one; {default} is used")
        elif name == "odom_frame" and len(distinct) > 1:
            self.found.unknown.append(f"{name}: the nodes name {', '.join(distinct)}; {distinct[0]} is used")

    def _odom_frames(self) -> Iterator[str]:
        yield from (str(params.get("odom_frame_id", "odom")) for params in self._drives)
        for view in self._of("amcl/amcl"):
            yield view.frame("odom_frame_id", "odom")
        for view in self._of(*_MAPPERS, *FILTERS):
            yield view.frame("odom_frame", "odom")
        for view in self._of("move_base/move_base"):
            frame = view.frame("local_costmap/global_frame", "")
            yield "" if frame == "map" else frame

    def _base_frames(self) -> list[str]:
        bases = [str(params.get("base_frame_id", "base_link")) for params in self._drives]
        bases += [view.frame("base_frame_id", "base_link") for view in self._of("amcl/amcl")]
        bases += [view.frame("base_frame", "base_link") for view in self._of(*_MAPPERS)]
        bases += [view.frame("base_link_frame", "base_link") for view in self._of(*FILTERS)]
        for view in self._of("move_base/move_base"):
            bases += [
                view.frame(f"{costmap}/robot_base_frame", "base_link")
                for costmap in ("local_costmap", "global_costmap")
            ]
        return bases

    def _prefix(self) -> str:
        """Return the prefix of the robot's frames, such as `robot1/`."""
        prefix, slash, _ = str(self.found.params["base_frame"]).rpartition("/")
        return prefix + slash

    def _static(self) -> dict[str, list[float]]:
        """Return x, y, z and yaw of the frames that static_transform_publishers publish."""
        found = {}
        for view in self._of(*_STATIC):
            words = view.words()
            if len(words) in (8, 9, 10) and (frames := [word for word in words if not is_number(word)]):
                found[frames[-1].lstrip("/")] = [float(word) for word in words[:4] if is_number(word)]
        return found

    # -- the laser -------------------------------------------------------------------

    def laser(self) -> None:
        """Find the frame and the height of the laser."""
        if "scan" not in self.found.topics:
            return
        sources = [source for view in self._of("move_base/move_base") for source in view.sources()]
        sources = [source for source in sources if source.kind == "scan"]
        static = self._static()
        names_of_lasers = [
            each for each in (*self._links, *static) if any(word in each.lower() for word in _LASER_WORDS)
        ]
        frames = [source.frame for source in sources if source.frame] + names_of_lasers
        frame = frames[0] if frames else self._prefix() + "base_scan"
        self.found.params["scan_frame"] = frame
        laser = {}
        if frame in self._links:
            self.found.notes.append("scan_frame: a link of the robot description, which has its pose")
        elif frame in static and len(static[frame]) == 4:
            laser = dict(zip(("x", "y", "z", "yaw"), static[frame], strict=True))
            self.found.notes.append("scan_frame and laser: a static_transform_publisher")
        elif sources:
            low = max(source.min_height for source in sources)
            high = min(source.max_height for source in sources)
            if low < high and not low < LASER_HEIGHT_M < high:
                laser = {"z": round((low + min(high, low + 0.2)) / 2, 3)}
                self.found.notes.append(f"laser/z: costmaps keep obstacles from {low:g} to {high:g} m")
        if laser:
            self.found.params["laser"] = laser
        if self.found.params.get("publish_static_tf") is False and frame not in (*self._links, *static):
            self.found.unknown.append(
                f"the frame of the laser: no link of the robot description is named like one, and {frame} "
                "has no transform. Add a link, or a static_transform_publisher"
            )

    # -- the robot and its place -----------------------------------------------------

    def size(self) -> None:
        """Find the robot's radius and its greatest velocities."""
        robot: dict[str, Any] = {}
        meaning: Callable[[str], str | None] = offered("planner_limit") or str
        for view in self._of("move_base/move_base"):
            self._drive(view, robot)
            for key, value in view.params.items():
                name = key.rpartition("/")[2]
                if name == "robot_radius" and is_number(value):
                    robot["radius"] = float(value)
                elif name == "footprint" and (radius := inner_radius(value)):
                    robot["radius"] = radius
                elif not is_number(value):
                    continue
                elif (limit := meaning(name)) in ("max_vel_x", "max_vel_trans"):
                    robot["max_linear"] = max(robot.get("max_linear", 0.5), FASTER * float(value))
                elif limit == "max_vel_theta":
                    robot["max_angular"] = max(robot.get("max_angular", 2.5), FASTER * float(value))
        if "radius" not in robot:
            self.found.unknown.append("the robot's radius: move_base has no footprint; 0.15 m is used")
        if robot:
            rounded = {key: each if key == "drive" else round(each, 3) for key, each in robot.items()}
            self.found.params["robot"] = {key: value for key, value in rounded.items() if value}

    def _drive(self, view: NodeView, robot: dict[str, Any]) -> None:
        """Find out from the parameters of the local planner whether the base is a car, or drives sideways."""
        planner = str(view.params.get("base_local_planner", "base_local_planner/TrajectoryPlannerROS"))
        below = re.split("[/:]", planner)[-1]
        own = {path: each for path, each in view.params.items() if path.startswith(f"{below}/")}
        radius, sideways = least_turning_radius(own), own.get(f"{below}/max_vel_y", 0.0)
        if radius:
            robot |= {"drive": "ackermann", "min_turning_radius": radius}
        elif (is_number(sideways) and sideways > 0) or view.params.get(f"{below}/holonomic_robot") is True:
            robot["drive"] = "omni"
        if "drive" in robot:
            self.found.notes.append(f"robot/drive: {below} of {view.node.full_name}")

    def place(self) -> None:
        """Find the map and the robot's starting pose on it."""
        maps = [view.words()[0] for view in self._of("map_server/map_server") if view.words()]
        if not maps or not os.path.isfile(maps[0]):
            reason = f"{maps[0]} does not exist" if maps else "no map_server is started"
            self.found.unknown.append(f"the map: {reason}; the room that is built in is used")
            return
        self.found.params["map"] = maps[0]
        for view in self._of("amcl/amcl"):
            wanted = [view.params.get(f"initial_pose_{axis}", 0.0) for axis in "xya"]
            pose = [float(each) if is_number(each) else 0.0 for each in wanted]
            try:
                free = free_pose(maps[0], pose, self.found.params.get("robot", {}).get("radius", 0.15))
            except PiprosError as error:
                self.found.unknown.append(f"whether amcl's initial pose is free: {error}")
                return
            self.found.params["robots"] = [dict(zip(("x", "y", "yaw"), free, strict=True))]
            if free != pose:
                full = view.node.full_name
                self.found.overrides |= {
                    f"{full}/initial_pose_{axis}": value for axis, value in zip("xya", free, strict=True)
                }
                self.found.notes.append(f"initial_pose: {full}'s, {pose}, is not free on the map")

    def localization(self) -> None:
        """Report if no known node publishes the frame in which move_base plans."""
        odom = self.found.params["odom_frame"]
        known = {odom, *(view.frame("world_frame", "odom") for view in self._of(*FILTERS))}
        known.update(word.lstrip("/") for view in self._of(*_STATIC) for word in view.words())
        views = () if any(self._of(*_LOCALIZERS)) else self._of("move_base/move_base")
        frames = {view.frame("global_costmap/global_frame", "map") for view in views}
        for frame in sorted(frames - known):
            self.found.unknown.append(
                f"who publishes {frame} to {odom}, for which move_base waits: no known node does; start "
                "amcl, a mapper or fake_localization"
            )

    def others(self) -> None:
        """Report the nodes and properties that this program does not know."""
        unknown = [view for view in self._views if not view.is_known]
        if unknown:
            nodes = ", ".join(f"{view.node.full_name} ({view.kind})" for view in unknown)
            self.found.unknown.append(f"topics of {nodes}; if one drives hardware, leave it out")
        reasons = dict.fromkeys(why_no_package(package_of(view.kind)) for view in unknown)
        self.found.unknown += [f"topics of a node: {reason}" for reason in reasons if reason]
        if any(key.rpartition("/")[2] == "tf_prefix" and value for key, value in self._launch.params.items()):
            self.found.unknown.append("tf_prefix has no effect on the simulated robot")
