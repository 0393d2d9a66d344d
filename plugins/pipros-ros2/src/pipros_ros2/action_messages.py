"""Encode and decode the ROS 2 messages that all actions share.

The goal's ID precedes the fields of a goal and of feedback. Its 16 bytes do not change their alignment.
"""

from __future__ import annotations

import struct
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from pipros_libraries.actions.status import Status
from pipros_rosbag2.conversion.errors import ConversionError

ID_BYTES: Final = 16
NO_ID: Final = bytes(ID_BYTES)
"""The ID that selects all goals in a cancellation request."""
_HEADER: Final = b"\0\1\0\0"
_TIME: Final = struct.Struct("<iI")
_COUNT: Final = struct.Struct("<I")
_INFO_BYTES: Final = ID_BYTES + _TIME.size
_PADDING: Final = 3
"""Padding in bytes between the ID and the time of each status in an array, except in the first status."""
_STATUS_BYTES: Final = _INFO_BYTES + _PADDING + 1
_NAMESPACE: Final = uuid.UUID("5a34b2e0-8d43-5a5c-a1c5-0b5d6a0e3d1f")
_LARGEST_S: Final = 0x7FFFFFFF
_SECOND_NS: Final = 1_000_000_000


class Ros2Status(IntEnum):
    """The constants of action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def has_ended(self) -> bool:
        return self >= Ros2Status.SUCCEEDED


class CancelCode(IntEnum):
    """The constants of action_msgs/srv/CancelGoal."""

    NONE = 0
    REJECTED = 1
    UNKNOWN_GOAL = 2
    GOAL_TERMINATED = 3


TO_ROS2: Final = {
    Status.PENDING: Ros2Status.ACCEPTED,
    Status.ACTIVE: Ros2Status.EXECUTING,
    Status.PREEMPTING: Ros2Status.CANCELING,
    Status.RECALLING: Ros2Status.CANCELING,
    Status.SUCCEEDED: Ros2Status.SUCCEEDED,
    Status.PREEMPTED: Ros2Status.CANCELED,
    Status.RECALLED: Ros2Status.CANCELED,
    Status.ABORTED: Ros2Status.ABORTED,
    Status.REJECTED: Ros2Status.ABORTED,
    Status.LOST: Ros2Status.ABORTED,
}
TO_ROS1: Final = {
    Ros2Status.UNKNOWN: Status.ABORTED,
    Ros2Status.ACCEPTED: Status.PENDING,
    Ros2Status.EXECUTING: Status.ACTIVE,
    Ros2Status.CANCELING: Status.PREEMPTING,
    Ros2Status.SUCCEEDED: Status.SUCCEEDED,
    Ros2Status.CANCELED: Status.PREEMPTED,
    Ros2Status.ABORTED: Status.ABORTED,
}


@dataclass(frozen=True, slots=True)
class GoalInfo:
    """The ID of a goal and the time at which it was accepted, in ns."""

    goal: bytes
    stamp_ns: int = 0


def id_in_ros2(goal_id: str) -> bytes:
    """Return the ROS 2 ID of a ROS 1 goal: `goal_id` itself if it is a UUID, otherwise one derived from it.

    >>> id_in_ros2("00112233-4455-6677-8899-aabbccddeeff").hex()
    '00112233445566778899aabbccddeeff'
    """
    try:
        found = uuid.UUID(goal_id)
        if str(found) == goal_id:
            return found.bytes
    except ValueError:
        pass
    return uuid.uuid5(_NAMESPACE, goal_id).bytes


def id_in_ros1(goal: bytes) -> str:
    """Return the ROS 1 ID of a ROS 2 goal."""
    return str(uuid.UUID(bytes=goal))


def with_id(goal: bytes, cdr: bytes) -> bytes:
    """Insert a goal ID into the CDR of a goal or of feedback.

    Return the CDR of the `send_goal` request or of the feedback message; if `cdr` is empty, that of the
    `get_result` request.
    """
    return _HEADER + goal + cdr[len(_HEADER) :]


def split_id(cdr: bytes | memoryview) -> tuple[bytes, bytes]:
    """Split a `send_goal` or `get_result` request, or a feedback message.

    Return the goal ID, and the fields after it as CDR.

    Raises:
        ConversionError: the message is not little-endian CDR, or is too short.
    """
    body = _body(cdr, ID_BYTES)
    return body[:ID_BYTES], _HEADER + body[ID_BYTES:]


def accepted_reply(stamp_ns: int, *, is_accepted: bool) -> bytes:
    """Return a `send_goal` reply."""
    return _HEADER + bytes([is_accepted, 0, 0, 0]) + _time(stamp_ns)


def is_accepted(cdr: bytes) -> bool:
    """Return whether a `send_goal` reply accepts the goal. Raises the same errors as `split_id`."""
    return _body(cdr, 1)[0] != 0


def cancel_request(goal: GoalInfo) -> bytes:
    """Return a `cancel_goal` request."""
    return _HEADER + _info(goal)


def parse_cancel_request(cdr: bytes) -> GoalInfo:
    """Parse a `cancel_goal` request. Raises the same errors as `split_id`."""
    body = _body(cdr, _INFO_BYTES)
    return GoalInfo(body[:ID_BYTES], _parse_time(body, ID_BYTES))


def cancel_reply(code: CancelCode, goals: Sequence[GoalInfo]) -> bytes:
    """Return a `cancel_goal` reply with the goals that will be cancelled."""
    return _HEADER + bytes([code, 0, 0, 0]) + _COUNT.pack(len(goals)) + b"".join(map(_info, goals))


def status_array(goals: Sequence[tuple[GoalInfo, Ros2Status]]) -> bytes:
    """Return an `action_msgs/msg/GoalStatusArray`."""
    parts = [_HEADER, _COUNT.pack(len(goals))]
    padding = b""
    for info, status in goals:
        parts += (info.goal, padding, _time(info.stamp_ns), bytes([status]))
        padding = bytes(_PADDING)
    return b"".join(parts)


def parse_status_array(cdr: bytes | memoryview, limit: int) -> list[tuple[GoalInfo, Ros2Status]]:
    """Parse the first `limit` statuses of a message; those with an undefined value are left out.

    Raises the same errors as `split_id`.
    """
    cdr = memoryview(cdr)[: len(_HEADER) + _COUNT.size + limit * _STATUS_BYTES]
    (count,) = _COUNT.unpack_from(_body(cdr, _COUNT.size))
    count = min(count, limit)
    body = _body(cdr, _COUNT.size + max(0, count * _STATUS_BYTES - _PADDING))
    # All statuses have the same size once padding is inserted after the first ID, where CDR has none.
    body = body[: _COUNT.size + ID_BYTES] + bytes(_PADDING) + body[_COUNT.size + ID_BYTES :]
    found = []
    for start in range(_COUNT.size, _COUNT.size + count * _STATUS_BYTES, _STATUS_BYTES):
        status = body[start + _STATUS_BYTES - 1]
        if status in Ros2Status._value2member_map_:
            stamp_ns = _parse_time(body, start + ID_BYTES + _PADDING)
            found.append((GoalInfo(body[start : start + ID_BYTES], stamp_ns), Ros2Status(status)))
    return found


def _body(cdr: bytes | memoryview, at_least: int) -> bytes:
    data = bytes(cdr)
    if data[:2] != _HEADER[:2] or len(data) < len(_HEADER) + at_least:
        raise ConversionError(
            f"expected little-endian CDR with at least {len(_HEADER) + at_least} bytes, got "
            f"{len(data)} bytes that begin with {data[:4].hex() or 'nothing'}"
        )
    return data[len(_HEADER) :]


def _info(goal: GoalInfo) -> bytes:
    return goal.goal + _time(goal.stamp_ns)


def _parse_time(body: bytes, start: int) -> int:
    seconds, nanoseconds = _TIME.unpack_from(body, start)
    return int(max(0, seconds) * _SECOND_NS + nanoseconds)


def _time(stamp_ns: int) -> bytes:
    return _TIME.pack(min(stamp_ns // _SECOND_NS, _LARGEST_S), stamp_ns % _SECOND_NS)
