"""Each shipped program that commands velocities: how a rig starts it, and what drives it."""

import contextlib
import importlib
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from pipros.msg import load_message_class
from pipros_libraries.nodes import program
from pipros_robot.navigation.world_parameters import PARAMETERS
from tests.support.motion import Rig
from tests.support.unlinked_node import BASE, message, odometry, transforms

SPEED: Final = 0.3
SOURCE_S: Final = 0.05
_SOURCES: Final = [
    {"name": "high", "topic": "/high", "timeout": 0.5, "priority": 100},
    {"name": "low", "topic": "/low", "timeout": 0.5, "priority": 10},
    {"name": "patient", "topic": "/patient", "timeout": 100.0, "priority": 1},
]
_LOCKS: Final = [{"name": "estop", "topic": "/estop", "timeout": 0.0, "priority": 255}]
_MUX: Final = str({"subscribers": [{**each, "short_desc": ""} for each in _SOURCES], "publisher": "out"})


def twist(speed: float) -> Any:
    made = message("geometry_msgs/Twist")
    made.linear.x = speed
    return made


@dataclass(frozen=True, slots=True)
class Program:
    """A program and its source of velocities.

    Attributes:
        run: its main function, or the class of its nodelet, as `module:name`.
        drive: gives the program one message, or whatever its source gives, for a speed.
        mask: makes the source lose the robot: a lock, a source with a higher priority, a cancellation.
        silence_s: the time after which a silent source no longer drives the robot.
        period_s: the longest time between two velocities.
        limit: the greatest speed that leaves the program.
    """

    run: str
    drive: Callable[[Rig, float], object]
    mask: Callable[[Rig], object] | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    silence_s: float = 0.5
    period_s: float = SOURCE_S
    limit: float = math.inf
    setup: Callable[[Rig], object] = lambda rig: None

    def begin(self, rig: Rig) -> object:
        """Run the program until the rig ends it."""
        file, _, name = self.run.partition(":")
        module = sys.modules[file]
        for each in (module, program):
            rig.runs(each)
        rig.node.start()
        with contextlib.suppress(LookupError):
            rig.node.params.delete("~")  # those of an earlier run
        for key, value in self.parameters.items():  # nested ones after the mappings that they change
            rig.node.params.set(f"~{key}", value)
        rig.prepare()
        self.setup(rig)
        if name == "main":
            return getattr(module, name)(*([] if self.run in _PLAIN else [[]]))
        made = getattr(module, name)(rig.node)
        rig.node.wait_for_shutdown()
        return made.close()


_TELEOP: Final = "pipros_libraries.teleoperation"
_VELOCITIES: Final = "pipros_robot.navigation.velocities"
_TURTLE: Final = "pipros_simulation.turtlesim"
_PLAIN: Final = {f"{_TELEOP}.twist_marker:main", "pipros_robot.navigation.move_base.move_base_node:main"}
"""Main functions without arguments."""


def _speak_once(rig: Rig) -> None:
    """Let a source of a multiplexer speak that may be silent for long."""
    rig.at(0.1, lambda: rig.give("/patient", twist(0.1)))


def _raw(rig: Rig, speed: float) -> None:
    """Measure what the base was sent, and give a command."""
    measured = odometry()
    measured.twist.twist.linear.x = rig.sent[-1][1][0] if rig.sent else 0.0
    rig.give("/tested/odometry", measured)
    rig.give("/tested/raw_cmd_vel", twist(speed))


def _joy(rig: Rig, speed: float) -> None:
    rig.give("/joy", message("sensor_msgs/Joy", axes=[0.0, speed / 0.5], buttons=[1]))


def _feedback(rig: Rig, speed: float) -> None:
    kind: Any = load_message_class("visualization_msgs/InteractiveMarkerFeedback")
    made = kind(marker_name="robot_twist_marker", client_id="viewer", event_type=kind.POSE_UPDATE)
    made.pose.position.x, made.pose.orientation.w = speed, 1.0
    rig.give("/twist_marker_server/feedback", made)


def _slider(rig: Rig, speed: float) -> None:
    if math.isfinite(speed):  # the page refuses others
        rig.shown.move("linear", max(-3.0, min(speed, 3.0)))


def _key(rig: Rig, speed: float) -> None:
    rig.pressed = ["i" if speed else "k"]


def _arrow(rig: Rig, speed: float) -> None:
    rig.pressed = ["A"]


def _bumper(rig: Rig, state: float) -> None:
    rig.give("/tested/events/bumper", message("kobuki_msgs/BumperEvent", state=int(state != 0), bumper=1))


def _turtle(topic: str) -> Callable[[Rig, float], None]:
    def give(rig: Rig, speed: float) -> None:
        rig.give(topic, message("turtlesim/Pose", x=5.0, y=5.0, linear_velocity=speed))

    return give


class Room:
    """A round room with a radius of 4 m, in which a robot follows its commands."""

    def __init__(self, rig: Rig) -> None:
        self._rig, self._pose = rig, [0.0, 0.0, 0.0]
        self.lost: set[str] = set()
        rig.world, self.has_goal = self, False
        rig.subscribed = self._first
        rig.every(SOURCE_S, self._step)

    def _first(self, topic: str, callback: Any) -> None:
        if topic == "/tf":  # the costmaps wait for it
            callback(transforms("odom", BASE))

    def _step(self) -> None:
        sent = self._rig.sent
        linear, turn = (sent[-1][1][0], sent[-1][1][5]) if sent else (0.0, 0.0)
        pose = self._pose
        pose[0] += linear * SOURCE_S * math.cos(pose[2])
        pose[1] += linear * SOURCE_S * math.sin(pose[2])
        pose[2] += turn * SOURCE_S
        where = transforms("odom", BASE)
        half, placed = pose[2] / 2, where.transforms[0].transform
        placed.translation.x, placed.translation.y = pose[:2]
        placed.rotation.z, placed.rotation.w = math.sin(half), math.cos(half)
        seen = message("sensor_msgs/LaserScan", BASE, angle_min=-3.0, angle_increment=0.1, angle_max=3.0,
                       range_min=0.1, range_max=10.0)  # fmt: skip
        seen.ranges = [self._distance(pose[2] - 3.0 + 0.1 * ray) for ray in range(61)]
        measured = odometry(pose[0])
        measured.twist.twist.linear.x, measured.twist.twist.angular.z = linear, turn
        for topic, given in (("/tf", where), ("/odom", measured), ("/scan", seen)):
            if topic not in self.lost:
                self._rig.give(topic, given)

    def _distance(self, angle: float) -> float:
        x, y = self._pose[:2]
        along = x * math.cos(angle) + y * math.sin(angle)
        return math.sqrt(max(along**2 + 16.0 - x**2 - y**2, 0.0)) - along


def send_goal(rig: Rig, x: float = 2.5) -> None:
    goal = message("geometry_msgs/PoseStamped", "odom")
    goal.pose.position.x, goal.pose.orientation.w = x, 1.0
    rig.give("/move_base_simple/goal", goal)


def _goal(rig: Rig, speed: float) -> None:
    if speed and not rig.world.has_goal:
        rig.world.has_goal = True
        send_goal(rig)


_ROOM: Final = {"global_frame": "odom", "rolling_window": True, "width": 7, "height": 7}
MOVE_BASE: Final = {
    **PARAMETERS["move_base"],
    "controller_frequency": 10.0,
    "global_costmap": {**PARAMETERS["move_base"]["local_costmap"], **_ROOM},
}

PROGRAMS: Final[Mapping[str, Program]] = {
    "twist_mux": Program(f"{_TELEOP}.twist_mux_node:main", lambda rig, speed: rig.give("/low", twist(speed)),
        lambda rig: rig.give("/estop", message("std_msgs/Bool", data=True)),
        {"topics": _SOURCES, "locks": _LOCKS}, setup=_speak_once),
    "yocs_cmd_vel_mux": Program(f"{_VELOCITIES}.cmd_vel_mux_node:CmdVelMuxNode", lambda rig,
        speed: rig.give("/low", twist(speed)),
        lambda rig: rig.every(SOURCE_S, lambda: rig.give("/high", twist(0.0)), rig.now_s),
        {"yaml_cfg_data": _MUX}, setup=_speak_once),
    "yocs_velocity_smoother": Program(f"{_VELOCITIES}.velocity_smoother_node:SmootherNode", _raw,
        parameters={"accel_lim_v": 5.0, "speed_lim_w": 1.0, "robot_feedback": 1}, limit=1.0),
    "kobuki_safety_controller": Program(f"{_VELOCITIES}.safety_controller_node:SafetyNode", _bumper,
        lambda rig: rig.give("/tested/disable", message("std_msgs/Empty")), silence_s=math.inf, limit=0.4),
    "teleop_twist_joy": Program(f"{_TELEOP}.twist_joy_node:main", _joy),
    "teleop_twist_keyboard": Program(f"{_TELEOP}.keyboard_node:main", _key, limit=0.5, period_s=0.1),
    "interactive_marker_twist_server": Program(f"{_TELEOP}.twist_marker:main", _feedback, limit=1.0),
    "rqt_robot_steering": Program("pipros_page.robot_steering:main", _slider, period_s=0.1, limit=3.0),
    "turtle_teleop_key": Program(f"{_TURTLE}.teleop_key:main", _arrow, silence_s=math.inf, limit=2.0),
    "mimic": Program(f"{_TURTLE}.mimic:main", _turtle("/input/pose")),
    "draw_square": Program(f"{_TURTLE}.draw_square:main", _turtle("/turtle1/pose"), limit=1.0),
    "move_base": Program("pipros_robot.navigation.move_base.move_base_node:main", _goal,
        lambda rig: rig.give("/move_base/cancel", message("actionlib_msgs/GoalID")), MOVE_BASE,
        silence_s=math.inf, period_s=0.1, limit=2.0, setup=Room),
}  # fmt: skip
"""All of them but the page's Teleop tab, which asks a policy's gate: see `test_teleop`."""

for _each in PROGRAMS.values():
    importlib.import_module(_each.run.partition(":")[0])  # before a rig replaces the timers
