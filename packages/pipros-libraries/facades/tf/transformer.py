"""tf's `Transformer`, a transform buffer that returns positions and quaternions as lists."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import rospy
import tf2_ros
from pipros.msg.time import NS_PER_S
from pipros_libraries.transforms.messages import in_ns
from pipros_libraries.transforms.pose import Pose, Vector
from pipros_libraries.transforms.twist import interval_around, twist

PositionAndRotation = tuple[list[float], list[float]]


def strip_leading_slash(s: str) -> str:
    """Return the frame ID without the leading slash that the first versions of tf used."""
    return s[1:] if s.startswith("/") else s


class Transformer:
    """Buffer for the transforms of the last `cache_time` (a `rospy.Duration`; 10 s by default).

    `interpolate` is ignored, as in Noetic. All methods may be called from any thread.
    """

    def __init__(self, interpolate: bool = True, cache_time: Any = None) -> None:  # noqa: ARG002
        self._buffer = tf2_ros.Buffer(cache_time, debug=False)
        self._using_dedicated_thread = False

    def allFramesAsDot(self, current_time: Any = None) -> str:
        """Return the frame tree in Graphviz's DOT language."""
        return self._buffer._allFramesAsDot(current_time or None)

    def _repr_html_(self) -> str:
        """Return the frame tree as HTML, for notebooks."""
        return self._buffer._repr_html_()

    def allFramesAsString(self) -> str:
        """Return one line for each frame except roots, with the names of the frame and its parent."""
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
            tf.Exception: `timeout` expired, or `setUsingDedicatedThread(True)` was not called.
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
            tf.Exception: `timeout` expired, or `setUsingDedicatedThread(True)` was not called.
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
        """Return the position (x, y, z) and quaternion (x, y, z, w) of the source frame in the target frame.

        If `time` is zero, use the latest common time. Does not block.

        Raises:
            tf.LookupException, tf.ConnectivityException, tf.ExtrapolationException, tf.Exception.
        """
        target, source = strip_leading_slash(target_frame), strip_leading_slash(source_frame)
        return _as_lists(self._buffer._lookup(target, source, time))

    def lookupTransformFull(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> PositionAndRotation:
        """Like `lookupTransform`, but with the source at `source_time` and the target at `target_time`.

        `fixed_frame` must not move between these times.
        """
        arguments = _without_slashes(target_frame, target_time, source_frame, source_time, fixed_frame)
        return _as_lists(self._buffer._lookup_full(*arguments))

    def lookupTwist(
        self, tracking_frame: str, observation_frame: str, time: Any, averaging_interval: Any
    ) -> tuple[Vector, Vector]:
        """Return the linear (m/s) and angular (rad/s) velocity of `tracking_frame` in `observation_frame`.

        The velocities are averages over `averaging_interval` around `time`. If `time` is zero, or transforms
        are not yet available for the whole interval, the interval ends at the latest common time.
        """
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
        """Like `lookupTwist`, but in `reference_frame` and for the origin of `reference_point_frame`."""
        latest = self.getLatestCommonTime(observation_frame, tracking_frame)
        target_time = time or latest
        start, end = interval_around(in_ns(target_time), in_ns(latest), in_ns(averaging_interval))
        return twist(
            self._pose(observation_frame, tracking_frame, rospy.Time(*divmod(start, NS_PER_S))),
            self._pose(observation_frame, tracking_frame, rospy.Time(*divmod(end, NS_PER_S))),
            end - start,
            self._pose(reference_frame, tracking_frame, target_time),
            self._pose(reference_frame, reference_point_frame, target_time),
        )

    def setUsingDedicatedThread(self, value: bool) -> None:
        """Declare whether another thread fills the buffer. If not, `waitForTransform` raises."""
        self._using_dedicated_thread = value

    def getTFPrefix(self) -> str:
        """Return an empty string: tf2 has no prefixes."""
        return ""

    def _pose(self, target: str, source: str, time: Any) -> Pose:
        # Call lookupTransform, as Noetic does, because subclasses may override it.
        (px, py, pz), (qx, qy, qz, qw) = self.lookupTransform(target, source, time)
        return px, py, pz, qx, qy, qz, qw

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


def _as_lists(found: tuple[int, Pose]) -> PositionAndRotation:
    _, pose = found
    return [*pose[:3]], [*pose[3:]]
