"""Interactive markers with each kind of control, like the example "basic controls"; prints feedback."""

from __future__ import annotations

import json
import math
import sys

from geometry_msgs.msg import Pose, Quaternion, TransformStamped
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    Marker,
    MenuEntry,
)

import rospy
import tf2_ros
from interactive_markers.interactive_marker_server import InteractiveMarkerServer

UPRIGHT = Quaternion(0, 1, 0, 1)  # the control's x axis is the marker's z axis
TURNED = (-1.0, 1.0, 0.8)  # x, y and yaw of the frame `turned`


def pose_in(frame: str, x: float, y: float) -> Pose:
    """Return the pose without rotation in `frame` of a place in `map`."""
    made = Pose()
    if frame == "turned":
        x, y = x - TURNED[0], y - TURNED[1]
        cos, sin = math.cos(TURNED[2]), math.sin(TURNED[2])
        x, y = cos * x + sin * y, cos * y - sin * x
    made.position.x, made.position.y, made.orientation.w = x, y, 1.0
    return made


def marker(name: str, mode: str, x: float, y: float, frame: str = "map") -> InteractiveMarker:
    made = InteractiveMarker(header=Header(frame_id=frame), name=name, scale=2.0, pose=pose_in(frame, x, y))
    number = getattr(InteractiveMarkerControl, mode)
    control = InteractiveMarkerControl(name=f"{name}_control", interaction_mode=number, always_visible=True)
    control.orientation = Quaternion(0, 0, 0, 1) if mode == "MOVE_AXIS" else UPRIGHT
    made.controls.append(control)
    return made


def cube(made: InteractiveMarker) -> InteractiveMarker:
    """Draw a marker's control as a cube."""
    shape = Marker(type=Marker.CUBE)
    shape.pose.orientation.w = 1.0
    shape.scale.x = shape.scale.y = shape.scale.z = 1.0
    shape.color.b = shape.color.a = 1.0
    made.controls[0].markers.append(shape)
    return made


def markers() -> list[InteractiveMarker]:
    menus = [cube(marker("menu", "MENU", 4, 0)), cube(marker("menu_left", "MENU", 6, 0))]
    for each in menus:
        each.menu_entries = [MenuEntry(id=1, title="First"), MenuEntry(id=2, title="Second")]
    facing = cube(marker("facing", "MOVE_PLANE", -6, -4))
    facing.controls[0].orientation_mode = InteractiveMarkerControl.VIEW_FACING
    fixed = marker("fixed", "ROTATE_AXIS", 0, -4)
    fixed.controls[0].orientation_mode = InteractiveMarkerControl.FIXED
    stamped = cube(marker("stamped", "MOVE_PLANE", -4, -4, "turned"))
    stamped.header.stamp = rospy.Time.now()
    return [
        marker("move_axis", "MOVE_AXIS", -6, 4), marker("move_plane", "MOVE_PLANE", -2, 4),
        marker("rotate_axis", "ROTATE_AXIS", 2, 4), marker("move_rotate", "MOVE_ROTATE", 6, 4),
        cube(marker("move_3d", "MOVE_3D", -6, 0)), cube(marker("move_3d_deep", "MOVE_3D", -4, 0)),
        cube(marker("rotate_3d", "ROTATE_3D", -2, 0)), cube(marker("move_rotate_3d", "MOVE_ROTATE_3D", 0, 0)),
        cube(marker("button", "BUTTON", 2, 0)), *menus, facing, stamped,
        cube(marker("locked", "MOVE_PLANE", -2, -4, "turned")), fixed,
    ]  # fmt: skip


def show(feedback: InteractiveMarkerFeedback) -> None:
    position, orientation, point = feedback.pose.position, feedback.pose.orientation, feedback.mouse_point
    found = {
        "frame_id": feedback.header.frame_id, "has_stamp": not feedback.header.stamp.is_zero(),
        "client_id": feedback.client_id, "marker_name": feedback.marker_name,
        "control_name": feedback.control_name, "event_type": feedback.event_type,
        "position": [position.x, position.y, position.z],
        "orientation": [orientation.x, orientation.y, orientation.z, orientation.w],
        "menu_entry_id": feedback.menu_entry_id, "mouse_point": [point.x, point.y, point.z],
        "mouse_point_valid": bool(feedback.mouse_point_valid),
    }  # fmt: skip
    sys.stdout.write(f"{json.dumps(found)}\n")
    sys.stdout.flush()


def main() -> None:
    rospy.init_node("controls_program")
    rospy.Subscriber("/controls/feedback", InteractiveMarkerFeedback, show)
    frames = tf2_ros.StaticTransformBroadcaster()
    turned = TransformStamped(header=Header(frame_id="map"), child_frame_id="turned")
    turned.transform.translation.x, turned.transform.translation.y = TURNED[:2]
    turned.transform.rotation.z, turned.transform.rotation.w = (
        math.sin(TURNED[2] / 2),
        math.cos(TURNED[2] / 2),
    )
    frames.sendTransform(turned)
    server = InteractiveMarkerServer("controls")
    for each in markers():
        server.insert(each, lambda _: None)
    server.applyChanges()
    rospy.spin()


if __name__ == "__main__":
    main()
