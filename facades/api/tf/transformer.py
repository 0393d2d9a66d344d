"""tf's `Transformer`, a transform buffer that returns positions and quaternions as lists."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import rospy
import tf2_ros
from pipros.libraries.transforms.pose import IDENTITY, Pose, composed, inverted, normalized

PositionAndRotation = tuple[list[float], list[float]]
Vector = tuple[float, float, float]


def strip_leading_slash(s: str) -> str:
    """Return the frame id without the leading slash that the first versions of tf used."""
    return s[1:] if s.startswith("/") else s


class Transformer:
    """Buffer of the transforms of the last `cache_time` (a `rospy.Duration`; 10 s by default).

    `interpolate` is ignored, as in Noetic. All methods may be called from any thread.
    """

    def __init__(self, interpolate: bool = True, cache_time: Any = None) -> None:  # noqa: ARG002
        self._buffer = tf2_ros.Buffer(cache_time, debug=False)
        self._using_dedicated_thread = False

    def allFramesAsDot(self, current_time: Any = None) -> str:
        """Return the frame tree in Graphviz's DOT language."""
        return self._buffer._allFramesAsDot(current_time or None)

    def allFramesAsString(self) -> str:
        """Return one line per frame, with its parent."""
        return self._buffer.all_frames_as_string()

    def setTransform(self, transform: Any, authority: str = "default_authority") -> None:
        """Add a TransformStamped."""
        self._buffer.set_transform(transform, authority)

    def canTransform(self, target_frame: str, source_frame: str, time: Any) -> Any:
        """Return whether `lookupTransform` would succeed. Does not block."""
        target, source = strip_leading_slash(target_frame), strip_leading_slash(source_frame)
        return self._buffer.can_transform(target, source, time)

    def canTransformFull(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> Any:
        """Return whether `lookupTransformFull` would succeed. Does not block."""
        arguments = _without_slashes(target_frame, target_time, source_frame, source_time, fixed_frame)
        return self._buffer.can_transform_full(*arguments)

    def waitForTransform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any,
        polling_sleep_duration: Any = None,  # noqa: ARG002 # nothing is polled
    ) -> None:
        """Block until `lookupTransform` would succeed.

        Raises:
            tf.Exception: `timeout` expired, or no listener fills the buffer (`setUsingDedicatedThread`).
        """
        self._require_listener()
        target, source = strip_leading_slash(target_frame), strip_leading_slash(source_frame)
        result = self._buffer.can_transform(target, source, time, timeout, return_debug_tuple=True)
        _require_success(result, source_frame, target_frame)

    def waitForTransformFull(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any,
        polling_sleep_duration: Any = None,  # noqa: ARG002
    ) -> None:
        """Block until `lookupTransformFull` would succeed.

        Raises:
            tf.Exception: `timeout` expired, or no listener fills the buffer (`setUsingDedicatedThread`).
        """
        self._require_listener()
        arguments = _without_slashes(target_frame, target_time, source_frame, source_time, fixed_frame)
        result = self._buffer.can_transform_full(*arguments, timeout, return_debug_tuple=True)
        _require_success(result, source_frame, target_frame)

    def chain(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> list[str]:
        """Return the frames on the path from the source via the fixed frame to the target."""
        return self._buffer._chain(target_frame, target_time, source_frame, source_time, fixed_frame)

    def clear(self) -> None:
        """Remove all transforms except static ones."""
        self._buffer.clear()

    def frameExists(self, frame_id: str) -> bool:
        """Return whether the frame has a parent."""
        return frame_id in self.getFrameStrings()

    def getFrameStrings(self) -> list[str]:
        """Return the frames that have a parent."""
        return [child for _, child, *_ in self._buffer._edges()]

    def getLatestCommonTime(self, source_frame: str, dest_frame: str) -> rospy.Time:
        """Return the latest time at which a transform between the frames is available."""
        source, target = strip_leading_slash(source_frame), strip_leading_slash(dest_frame)
        return self._buffer.get_latest_common_time(source, target)

    def lookupTransform(self, target_frame: str, source_frame: str, time: Any) -> PositionAndRotation:
        """Return the pose of the source in the target: position (x, y, z) and quaternion (x, y, z, w).

        `time` zero means the latest common time. Does not block.

        Raises:
            tf.LookupException, tf.ConnectivityException, tf.ExtrapolationException, tf.Exception.
        """
        target, source = strip_leading_slash(target_frame), strip_leading_slash(source_frame)
        return _as_lists(self._buffer.lookup_transform(target, source, time))

    def lookupTransformFull(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> PositionAndRotation:
        """Like `lookupTransform`, but with the source at `source_time` and the target at `target_time`.

        `fixed_frame` does not move between these times.
        """
        arguments = _without_slashes(target_frame, target_time, source_frame, source_time, fixed_frame)
        return _as_lists(self._buffer.lookup_transform_full(*arguments))

    def lookupTwist(
        self, tracking_frame: str, observation_frame: str, time: Any, averaging_interval: Any
    ) -> tuple[Vector, Vector]:
        """Return the linear (m/s) and angular (rad/s) velocity of a frame in another around `time`."""
        return self.lookupTwistFull(
            tracking_frame,
            observation_frame,
            observation_frame,
            (0, 0, 0),
            tracking_frame,
            time,
            averaging_interval,
        )

    def lookupTwistFull(
        self,
        tracking_frame: str,
        observation_frame: str,
        reference_frame: str,
        ref_point: Sequence[float],  # noqa: ARG002 # ignored, as in Noetic
        reference_point_frame: str,
        time: Any,
        averaging_interval: Any,
    ) -> tuple[Vector, Vector]:
        """Like `lookupTwist`, expressed in `reference_frame`, for the origin of `reference_point_frame`."""
        latest = self.getLatestCommonTime(observation_frame, tracking_frame)
        target_time = time or latest
        end = min(target_time + rospy.Duration(0.5 * averaging_interval.to_sec()), latest)
        start = max(rospy.Time(0.0001) + averaging_interval, end) - averaging_interval
        seconds = (end - start).to_sec()
        before = self._pose(observation_frame, tracking_frame, start)
        after = self._pose(observation_frame, tracking_frame, end)
        rotation = _rotation_vector(composed(inverted(before), after))
        tracked = self._pose(reference_frame, tracking_frame, target_time)
        point = self._pose(reference_frame, reference_point_frame, target_time)

        turn = (*IDENTITY[:3], *tracked[3:])
        moved = tuple(
            (later - earlier) / seconds for later, earlier in zip(after[:3], before[:3], strict=True)
        )
        linear = composed(turn, (*moved, *IDENTITY[3:]))[:3]
        angular = composed(turn, (*(part / seconds for part in rotation), *IDENTITY[3:]))[:3]
        origin = tracked[:3]
        # Change of the reference point. Like Noetic (compared in tests/interop), this adds a cross product of
        # the origin and a scalar product to each component, which is not the usual kinematic formula.
        moved_point = composed(point, (*origin, *IDENTITY[3:]))[:3]
        around = _cross(origin, angular)
        share = sum(a * (p - o) for a, p, o in zip(angular, moved_point, origin, strict=True))
        x, y, z = (v + a + share for v, a in zip(linear, around, strict=True))
        return (x, y, z), angular

    def setUsingDedicatedThread(self, value: bool) -> None:
        """Declare whether another thread fills the buffer; if there is none, `waitForTransform` raises."""
        self._using_dedicated_thread = value

    def getTFPrefix(self) -> str:
        """Return an empty string: tf2 has no prefixes."""
        return ""

    def _pose(self, target: str, source: str, time: Any) -> Pose:
        (px, py, pz), (qx, qy, qz, qw) = self.lookupTransform(target, source, time)
        return normalized((px, py, pz, qx, qy, qz, qw))

    def _require_listener(self) -> None:
        if not self._using_dedicated_thread:
            raise tf2_ros.TransformException(
                "cannot wait for transform without a dedicated thread that listens to incoming TF messages"
            )


def _without_slashes(
    target: str, target_time: Any, source: str, source_time: Any, fixed: str
) -> tuple[str, Any, str, Any, str]:
    return (
        strip_leading_slash(target),
        target_time,
        strip_leading_slash(source),
        source_time,
        strip_leading_slash(fixed),
    )


def _require_success(result: tuple[int, str], source: str, target: str) -> None:
    if not result[0]:
        raise tf2_ros.TransformException(result[1] or f'no such transformation: "{source}" -> "{target}"')


def _as_lists(message: Any) -> PositionAndRotation:
    position, rotation = message.transform.translation, message.transform.rotation
    return [position.x, position.y, position.z], [rotation.x, rotation.y, rotation.z, rotation.w]


def _cross(one: Vector, other: Vector) -> Vector:
    a, b, c = one
    x, y, z = other
    return b * z - c * y, c * x - a * z, a * y - b * x


def _rotation_vector(pose: Pose) -> Vector:
    """Return the rotation vector of a pose: the axis, scaled by the angle in radians (0 to pi)."""
    x, y, z, w = pose[3:]
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    length = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(length, w) / length if length else 2.0
    return x * factor, y * factor, z * factor
