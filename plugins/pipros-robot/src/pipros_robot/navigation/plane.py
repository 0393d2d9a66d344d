"""Poses in the plane, as (x, y, yaw) in metres and radians, and conversion to and from messages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros_libraries.nodes.wiring import stamped
from pipros_libraries.transforms.messages import pose_of
from pipros_libraries.transforms.pose import Pose, roll_pitch_yaw
from pipros_robot.perception.clouds.points import cloud_of

MAPPED_CELLS = 100_000_000
"""Maximum number of cells in the map of slam_gmapping or hector_mapping. Beyond it, the map of
`slam_gmapping` does not grow further, and scans are cut off at its border; `hector_mapping` refuses a larger
`~map_size`.
"""

Triple = tuple[float, float, float]
Poses = NDArray[np.float64]


def flat(pose: Pose) -> Triple:
    """Project a pose onto the plane."""
    return pose[0], pose[1], roll_pitch_yaw(pose)[2]


MOST: Final = 1e9
"""Maximum coordinate in metres; messages with larger ones are dropped."""


MOST_BEAMS: Final = 8192
"""Maximum number of beams of a scan that is mapped; the time and memory for a scan grow with the number."""


def thinned(points: NDArray[Any], most: int = MOST_BEAMS) -> NDArray[Any]:
    """Return every n-th point, so that there are at most `most`."""
    return points[:: max(1, -(-len(points) // most))]


def is_measured(pose: Pose) -> bool:
    """Return whether a pose has finite coordinates and a quaternion that determines an orientation."""
    return all(abs(each) <= MOST for each in pose) and math.hypot(*pose[3:]) >= 1e-3


def is_upright(turn: Any) -> bool:
    """Return whether a quaternion is finite, not too small, and keeps the z axis upright."""
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    squared = x * x + y * y + z * z + w * w
    return math.isfinite(squared) and squared >= 1e-6 and abs(1 - 2 * (x * x + y * y) / squared - 1) <= 1e-3


def flat_message(pose: Any) -> Triple:
    """Project a geometry_msgs/Pose onto the plane."""
    return flat(pose_of(pose.position, pose.orientation))


def in_frame(frame: Triple, poses: Poses) -> Poses:
    """Convert poses of shape (n, 3) from a frame with the pose `frame` to its parent frame."""
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    x, y, yaw = poses.T
    return np.column_stack(
        (frame[0] + cosine * x - sine * y, frame[1] + sine * x + cosine * y, yaw + frame[2])
    )


def raised(pose: Triple) -> Pose:
    """Convert a pose in the plane to a pose in space."""
    return (pose[0], pose[1], 0.0, 0.0, 0.0, math.sin(pose[2] / 2), math.cos(pose[2] / 2))


def fill(position: Any, orientation: Any, pose: Pose) -> None:
    """Write a pose to the two parts of a message, such as the translation and rotation of a Transform."""
    position.x, position.y, position.z = pose[:3]
    orientation.x, orientation.y, orientation.z, orientation.w = pose[3:]


def transforms(parent: str, child: str, pose: Pose, stamp: Time | int) -> Any:
    """Return a tf2_msgs/TFMessage with one transform."""
    transform = stamped("geometry_msgs/TransformStamped", parent, stamp, child_frame_id=child)
    fill(transform.transform.translation, transform.transform.rotation, pose)
    message: Any = load_message_class("tf2_msgs/TFMessage")
    return message([transform])


def pose_messages(poses: Iterable[Any]) -> list[Any]:
    """Convert poses (x, y, yaw) to geometry_msgs/Pose."""
    rows = np.asarray(poses, float).reshape(-1, 3)
    names = ("Pose", "Point", "Quaternion")
    pose, point, quaternion = (load_message_class(f"geometry_msgs/{name}") for name in names)
    columns = rows[:, 0], rows[:, 1], np.sin(rows[:, 2] / 2), np.cos(rows[:, 2] / 2)
    made: list[Any] = [
        pose(point(x, y, 0.0), quaternion(0.0, 0.0, sine, cosine))
        for x, y, sine, cosine in zip(*(each.tolist() for each in columns), strict=True)
    ]
    return made


class PoseMessages:
    """Poses (x, y, yaw) as a sequence of geometry_msgs/Pose, made when they are read, such as to be sent."""

    def __init__(self, poses: Poses) -> None:
        self._poses = poses

    def __len__(self) -> int:
        return len(self._poses)

    def __iter__(self) -> Iterator[Any]:
        return iter(pose_messages(self._poses))


def stamped_pose(pose: Triple, frame: str, stamp: Time) -> Any:
    """Return a geometry_msgs/PoseStamped."""
    return stamped("geometry_msgs/PoseStamped", frame, stamp, pose=pose_messages([pose])[0])


def path(poses: Any, frame: str, stamp: Time) -> Any:
    """Return a nav_msgs/Path with poses (x, y, yaw)."""
    kinds = "std_msgs/Header", "geometry_msgs/PoseStamped"
    header, posed = (load_message_class(each) for each in kinds)  # once: a plan has hundreds of poses
    made = [posed(header(0, stamp, frame), each) for each in pose_messages(poses)]
    return stamped("nav_msgs/Path", frame, stamp, poses=made)


def twist(velocity: Triple) -> Any:
    """Return a geometry_msgs/Twist with velocities along x and y and about z."""
    message: Any = load_message_class("geometry_msgs/Twist")()
    message.linear.x, message.linear.y, message.angular.z = velocity
    return message


def cloud(names: Iterable[str], values: NDArray[Any], frame: str, stamp: Time) -> Any:
    """Convert an array of shape (n, fields) to a sensor_msgs/PointCloud2 with float32 fields."""
    header = load_message_class("std_msgs/Header")(stamp=stamp, frame_id=frame)
    message = cloud_of(header, dict(zip(names, values.T.astype("<f4"), strict=True)))
    message.is_dense = True
    return message
