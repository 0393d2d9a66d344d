"""The node `marker_server` of interactive_marker_twist_server: a robot follows an interactive marker.

A viewer such as rviz drags the marker away from the robot; the distance determines the velocity. The marker
then returns to the robot.
"""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.throttle import Throttle
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S
from pipros.node import Node
from pipros_libraries.markers.state import Markers
from pipros_libraries.nodes.params import is_number, number, private, raw
from pipros_libraries.nodes.program import run_node
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.velocities import SILENCE_S, VelocityOutput, check_axis, checked_number
from pipros_libraries.nodes.wiring import advertise, subscribe
from pipros_libraries.transforms.pose import Vector, roll_pitch_yaw

NAMESPACE: Final = "twist_marker_server"
KEEP_ALIVE_S: Final = 0.5
_HALF: Final = math.sqrt(0.5)
_ORIENTATIONS: Final = {
    "x": (_HALF, 0.0, 0.0, _HALF),
    "y": (0.0, 0.0, _HALF, _HALF),
    "z": (0.0, _HALF, 0.0, _HALF),
}
"""Orientations of controls, whose x axes point along these axes of the robot."""


@dataclass(frozen=True, slots=True)
class Scales:
    """How distances become velocities.

    Attributes:
        linear: by axis, the velocity per metre, and its lowest and highest value.
        angular: angular velocity per radian.
        greatest_turn: the magnitude of the limit of the angular velocity.
    """

    linear: Mapping[str, tuple[float, float, float]]
    angular: float
    greatest_turn: float

    def velocity(self, position: Vector, yaw: float) -> tuple[Vector, float]:
        """Return the linear and the angular velocity for a pose of the marker relative to the robot."""
        found = [0.0, 0.0, 0.0]
        for axis, (scale, low, high) in self.linear.items():
            index = "xyz".index(axis)
            found[index] = max(min(scale * position[index], high), low)
        return (found[0], found[1], found[2]), max(
            min(self.angular * yaw, self.greatest_turn), -self.greatest_turn
        )


def read_scales(node: Node, log: logging.Logger) -> Scales:
    """Read the parameters. Linear ones are numbers for the axis x, or mappings from axes to numbers.

    Raises:
        InvalidParameter: a limit is not finite, or below its least value.
    """
    defaults = {
        "linear_scale": 1.0,
        "max_negative_linear_velocity": -1.0,
        "max_positive_linear_velocity": 1.0,
    }
    scales, low, high = (_by_axis(node, log, name, default) for name, default in defaults.items())
    for axis in scales:
        if axis not in low or axis not in high:
            log.error(
                "max_negative_linear_velocity and max_positive_linear_velocity must contain %s,"
                " as linear_scale does: 0 is used",
                axis,
            )
    linear = {axis: (scales[axis], low.get(axis, 0.0), high.get(axis, 0.0)) for axis in scales}
    for _, least, greatest in linear.values():
        check_axis(("~max_negative_linear_velocity", least), ("~max_positive_linear_velocity", greatest))
    turn = checked_number(node, "angular_scale", 2.2, least=-math.inf)
    return Scales(linear, turn, checked_number(node, "max_angular_velocity", 2.2))


def _by_axis(node: Node, log: logging.Logger, name: str, default: float) -> dict[str, float]:
    value = raw(node, name, default)
    given = value if isinstance(value, dict) else {"x": value}
    if all(axis in _ORIENTATIONS and is_number(each) and math.isfinite(each) for axis, each in given.items()):
        return {axis: float(each) for axis, each in given.items()}
    log.error(
        "~%s must be a number or a mapping from x, y, z to numbers, got %r: using %g", name, value, default
    )
    return {"x": default}


class TwistMarker:
    """Publishes `~cmd_vel` according to the feedback for its marker."""

    def __init__(self, node: Node, log: logging.Logger, schedule: Schedule) -> None:
        """Advertise, subscribe and publish the marker. Blocks until the master answers."""
        self._node, self._log, self._lock = node, Throttle(log, 5.0), threading.Lock()
        self._scales = read_scales(node, log)
        self._sequence = 0
        self._pose: Any = load_message_class("geometry_msgs/Pose")
        self._header: Any = load_message_class("std_msgs/Header")
        self._markers = Markers(load_message_class("visualization_msgs/InteractiveMarker"))
        self._marker = self._make_marker()
        self._markers.insert(self._marker)
        self._markers.set_callback(self._marker.name, self._drive, None)
        self._commands = VelocityOutput(node, "~cmd_vel", silence_s=SILENCE_S)
        init = "visualization_msgs/InteractiveMarkerInit"
        self._full = advertise(node, f"{NAMESPACE}/update_full", init, 100, latch=True)
        self._update = advertise(
            node, f"{NAMESPACE}/update", "visualization_msgs/InteractiveMarkerUpdate", 100
        )
        self._apply()
        feedback = "visualization_msgs/InteractiveMarkerFeedback"
        subscribe(node, f"{NAMESPACE}/feedback", feedback, self._on_feedback, 100)
        schedule.every(KEEP_ALIVE_S, self._keep_alive)

    def _make_marker(self) -> Any:
        robot = private(self._node, "robot_name", "robot")
        marker: Any = load_message_class("visualization_msgs/InteractiveMarker")()
        marker.header.frame_id = private(self._node, "link_name", "/base_link").lstrip("/")
        marker.name, marker.description = f"{robot}_twist_marker", f"twist controller for {robot}"
        marker.scale, marker.pose.orientation.w = number(self._node, "marker_size_scale", 1.0), 1.0
        control: Any = load_message_class("visualization_msgs/InteractiveMarkerControl")
        modes = [(f"move_{axis}", axis, control.MOVE_AXIS) for axis in self._scales.linear]
        for name, axis, mode in (*modes, ("rotate_z", "z", control.ROTATE_AXIS)):
            one = control(name=name, orientation_mode=control.FIXED, interaction_mode=mode)
            turn = one.orientation
            turn.x, turn.y, turn.z, turn.w = _ORIENTATIONS[axis]
            marker.controls.append(one)
        return marker

    def _on_feedback(self, feedback: Any) -> None:
        is_move = feedback.event_type == feedback.POSE_UPDATE
        with self._lock:
            now_s = self._node.clock.now_ns() / NS_PER_S
            drive = self._markers.take_feedback(feedback, is_move, now_s)
            if drive is None:
                return
            drive(feedback)
            self._markers.set_pose(self._marker.name, self._at_robot(), self._header())
            self._apply()

    def _drive(self, feedback: Any) -> None:
        """Publish the velocity for the marker's pose, or 0 if it is released or the pose is invalid."""
        place, turn = feedback.pose.position, feedback.pose.orientation
        pose = (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)
        norm = math.hypot(*pose[3:])
        twist: Any = load_message_class("geometry_msgs/Twist")()
        if not (all(map(math.isfinite, pose)) and 0.5 < norm < 2.0):
            self._log.warning("a pose of the marker is invalid: %s", pose)
        elif feedback.event_type != feedback.MOUSE_UP:
            linear, twist.angular.z = self._scales.velocity(pose[:3], roll_pitch_yaw(pose)[2])
            twist.linear.x, twist.linear.y, twist.linear.z = linear
        self._commands.publish(twist)

    def _at_robot(self) -> Any:
        pose = self._pose()
        pose.orientation.w = 1.0
        return pose

    def _apply(self) -> None:
        """Publish the pending changes. The caller holds the lock, or is the constructor."""
        changes = self._markers.apply()
        if changes is None:
            return
        self._sequence += 1
        moved: Any = load_message_class("visualization_msgs/InteractiveMarkerPose")
        poses = [moved(each.header, each.pose, each.name) for each in changes.moved]
        self._publish_update("UPDATE", markers=changes.inserted, poses=poses)
        init: Any = load_message_class("visualization_msgs/InteractiveMarkerInit")
        self._full.publish(init(self._node.name, self._sequence, [self._marker]))

    def _keep_alive(self) -> None:
        with self._lock:
            self._publish_update("KEEP_ALIVE")

    def _publish_update(self, kind: str, **fields: Any) -> None:
        update: Any = load_message_class("visualization_msgs/InteractiveMarkerUpdate")
        names = {"server_id": self._node.name, "seq_num": self._sequence, "type": getattr(update, kind)}
        self._update.publish(update(**names, **fields))


def main() -> int:
    """Run the node until it is shut down."""
    return run_node("marker_server", "interactive_marker_twist_server", TwistMarker)
