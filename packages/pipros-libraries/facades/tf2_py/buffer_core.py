"""`BufferCore`, a transform buffer that takes and returns messages."""

from __future__ import annotations

import sys
from typing import Any

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

import rospy
from pipros.msg.time import NS_PER_S
from pipros_libraries.transforms.buffer import DEFAULT_LENGTH, TransformBuffer
from pipros_libraries.transforms.errors import InvalidArgumentException
from pipros_libraries.transforms.messages import in_ns, pose_of_transform
from pipros_libraries.transforms.pose import Pose
from pipros_libraries.transforms.rejections import Rejections

_new = object.__new__


class BufferCore:
    """Buffer for static transforms and for the transforms of the last `cache_time` (10 s by default).

    Static transforms are kept until they are replaced. The reason for rejecting a transform is written to
    standard error, as in genuine tf2. All methods may be called from any thread.
    """

    _warning_stream: Any = None
    """Stream to which the reasons for rejecting transforms are written; None for standard error."""

    def __init__(self, cache_time: Any = None) -> None:
        self._buffer = TransformBuffer(DEFAULT_LENGTH if cache_time is None else in_ns(cache_time))
        self._rejections = Rejections(self._warn)

    def _repr_html_(self) -> str:
        """Return the frame tree as HTML, for notebooks."""
        return self._buffer._repr_html_()

    def set_transform(self, transform: Any, authority: str) -> None:
        """Add a TransformStamped. `authority` is the name of the node that published it."""
        self._insert(transform, authority, False)

    def set_transform_static(self, transform: Any, authority: str) -> None:
        """Add a static transform, given as a TransformStamped."""
        self._insert(transform, authority, True)

    def _insert(self, transform: Any, authority: str, is_static: bool) -> None:
        header = transform.header
        pose = pose_of_transform(transform.transform)
        stamp = in_ns(header.stamp)
        if authority.__class__ is not str and not isinstance(authority, str):
            raise TypeError(f"argument 2 must be str, not {type(authority).__name__}")
        reasons = self._buffer.insert(
            header.frame_id, transform.child_frame_id, stamp, pose, authority, is_static
        )
        for reason in reasons:
            self._rejections.add(transform.child_frame_id, reason)

    def lookup_transform_core(self, target_frame: str, source_frame: str, time: Any) -> TransformStamped:
        """Return the transform from the source frame to the target frame. Does not block.

        If `time` is zero, use the latest common time.

        Raises:
            LookupException, ConnectivityException, ExtrapolationException, InvalidArgumentException.
        """
        stamp, pose = self._lookup(target_frame, source_frame, time)
        return stamped(stamp, pose, target_frame, source_frame)

    def _lookup(self, target_frame: str, source_frame: str, time: Any) -> tuple[int, Pose]:
        return self._buffer.lookup(_require_str(target_frame, 1), _require_str(source_frame, 2), in_ns(time))

    def lookup_transform_full_core(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> TransformStamped:
        """Like `lookup_transform_core`, but with the source at `source_time` and the target at `target_time`.

        `fixed_frame` must not move between these times.
        """
        found = self._lookup_full(target_frame, target_time, source_frame, source_time, fixed_frame)
        return stamped(*found, target_frame, source_frame)

    def _lookup_full(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> tuple[int, Pose]:
        return self._buffer.lookup_full(
            _require_str(target_frame, 1),
            in_ns(target_time),
            _require_str(source_frame, 3),
            in_ns(source_time),
            _require_str(fixed_frame, 5),
        )

    def can_transform_core(self, target_frame: str, source_frame: str, time: Any) -> tuple[int, str]:
        """Return (1, "") if `lookup_transform_core` would succeed, otherwise (0, reason).

        If an argument is invalid, the reason is empty, and a warning is written to standard error.
        """
        _require_str(target_frame, 1), _require_str(source_frame, 2)
        try:
            reason = self._buffer.can_transform(target_frame, source_frame, in_ns(time))
        except InvalidArgumentException as error:
            self._warn(str(error))
            return (0, "")
        return (1, "") if reason is None else (0, reason)

    def can_transform_full_core(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> tuple[int, str]:
        """Return (1, "") if `lookup_transform_full_core` would succeed, otherwise (0, reason).

        Invalid arguments are handled as in `can_transform_core`.
        """
        _require_str(target_frame, 1), _require_str(source_frame, 3), _require_str(fixed_frame, 5)
        times = in_ns(target_time), in_ns(source_time)
        try:
            reason = self._buffer.can_transform_full(
                target_frame, times[0], source_frame, times[1], fixed_frame
            )
        except InvalidArgumentException as error:
            self._warn(str(error))
            return (0, "")
        return (1, "") if reason is None else (0, reason)

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> rospy.Time:
        """Return the latest time at which a transform between the frames is available."""
        target, source = _require_str(target_frame, 1), _require_str(source_frame, 2)
        return rospy.Time(*divmod(self._buffer.latest_common_time(target, source), NS_PER_S))

    def clear(self) -> None:
        """Remove all transforms except static ones."""
        self._buffer.clear()

    def all_frames_as_yaml(self, *_: Any) -> str:
        """Return all frames as YAML: parent, publishing node, rate in Hz, times in seconds."""
        return self._buffer.as_yaml()

    def all_frames_as_string(self, *_: Any) -> str:
        """Return a string with one line per frame, consisting of the names of the frame and its parent."""
        return self._buffer.as_string()

    def _allFramesAsDot(self, current_time: Any = None) -> str:
        return self._buffer.as_dot(None if current_time is None else in_ns(current_time) / NS_PER_S)

    def _edges(self) -> list[tuple[str, str, str, float]]:
        return self._buffer.edges()

    def _frameExists(self, frame_id: str) -> bool:
        return self._buffer.frame_exists(_require_str(frame_id, 1))

    def _getFrameStrings(self) -> list[str]:
        return self._buffer.frame_names()

    def _chain(
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str
    ) -> list[str]:
        return self._buffer.chain(
            target_frame, in_ns(target_time), source_frame, in_ns(source_time), fixed_frame
        )

    def _warn(self, text: str) -> None:
        print(f"Warning: {text}", file=self._warning_stream or sys.stderr, flush=True)


def stamped(stamp: int, pose: Pose, parent: str, child: str) -> TransformStamped:
    """Return a pose as a TransformStamped. `stamp` is in nanoseconds."""
    # The constructors are not called: they check each value, which would take a fifth of a lookup's time.
    time = _new(rospy.Time)
    time.secs, time.nsecs = divmod(stamp, NS_PER_S)
    header = _new(Header)
    header.seq, header.stamp, header.frame_id = 0, time, parent
    translation = _new(Vector3)
    rotation = _new(Quaternion)
    (
        translation.x,
        translation.y,
        translation.z,
        rotation.x,
        rotation.y,
        rotation.z,
        rotation.w,
    ) = pose
    transform = _new(Transform)
    transform.translation, transform.rotation = translation, rotation
    message = _new(TransformStamped)
    message.header, message.child_frame_id, message.transform = header, child, transform
    return message


def _require_str(value: Any, number: int) -> str:
    if isinstance(value, str):
        return value
    raise TypeError(f"argument {number} must be str, not {type(value).__name__}")
