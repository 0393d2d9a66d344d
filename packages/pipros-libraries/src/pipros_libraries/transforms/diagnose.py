"""Check recorded transforms: timestamps, rotations, parents, publishers and loops.

This module performs no I/O. Each check returns one text per problem.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from pipros.basics.printable import listed

TIME_TOLERANCE_S = 1.0
LENGTH_TOLERANCE = 1e-6
UNKNOWN_SENDER = "unknown_publisher"


@dataclass(frozen=True, slots=True)
class ReceivedTransform:
    """A received transform.

    Attributes:
        parent, child: frame IDs.
        sender: publishing node.
        ahead_s: timestamp minus arrival time, in seconds.
        rotation_length: norm of the quaternion; 1 for a valid rotation.
    """

    parent: str
    child: str
    sender: str
    ahead_s: float
    rotation_length: float


def received_in(message: Any, now: Any) -> list[ReceivedTransform]:
    """Return the transforms of a `tf2_msgs/TFMessage` that was received at the time `now`."""
    found = []
    for transform in message.transforms:
        rotation = transform.transform.rotation
        found.append(
            ReceivedTransform(
                transform.header.frame_id,
                transform.child_frame_id,
                message._connection_header.get("callerid", UNKNOWN_SENDER),
                (transform.header.stamp - now).to_sec(),
                math.hypot(rotation.x, rotation.y, rotation.z, rotation.w),
            )
        )
    return found


def of_other_times(received: Iterable[ReceivedTransform]) -> list[str]:
    """Report each node with timestamps that differ from the arrival times by more than `TIME_TOLERANCE_S`.

    The text states the node's largest difference.
    """
    furthest: dict[str, float] = {}
    for each in received:
        if abs(each.ahead_s) > max(TIME_TOLERANCE_S, abs(furthest.get(each.sender, 0.0))):
            furthest[each.sender] = each.ahead_s
    return [
        f"receiving transform from [{listed(sender)}] that differed from ROS time by {ahead_s}s"
        for sender, ahead_s in furthest.items()
    ]


def not_normalized(received: Iterable[ReceivedTransform]) -> list[str]:
    """Report quaternions whose norm is not 1."""
    return _each_once(
        f"rotation from [{listed(each.parent)}] to [{listed(each.child)}] is not unit length, "
        f"{each.rotation_length}"
        for each in received
        if not abs(each.rotation_length - 1) <= LENGTH_TOLERANCE  # also true for NaN
    )


def reparented(received: Iterable[ReceivedTransform]) -> list[str]:
    """Report frames whose parent changed."""
    parents: dict[str, str] = {}
    found = []
    for each in received:
        if parents.setdefault(each.child, each.parent) != each.parent:
            found.append(
                f"reparenting of [{listed(each.child)}] to [{listed(each.parent)}] by [{listed(each.sender)}]"
            )
            parents[each.child] = each.parent
    return _each_once(found)


def of_several_senders(received: Iterable[ReceivedTransform]) -> list[str]:
    """Report frames that more than one node publishes."""
    senders: dict[str, str] = {}
    found = []
    for each in received:
        before = senders.setdefault(each.child, each.sender)
        if before != each.sender:
            found.append(
                f"node [{listed(each.sender)}] publishing transform [{listed(each.child)}] with parent "
                f"[{listed(each.parent)}] already published by node [{listed(before)}]"
            )
            senders[each.child] = each.sender
    return _each_once(found)


def loops(received: Iterable[ReceivedTransform]) -> list[str]:
    """Report frames that are their own ancestors, according to each frame's latest parent."""
    parents = {each.child: each.parent for each in received}
    found = []
    for frame in parents:
        path = _path_up(frame, parents)
        if parents.get(path[-1]) == frame:
            elements = " -> ".join(map(listed, path))
            found.append(f"Frame {listed(frame)} is in a loop. It's loop has elements:\n{elements}")
    return found


def _path_up(frame: str, parents: dict[str, str]) -> Sequence[str]:
    """Return the frame and its ancestors, without repetitions."""
    path = {frame: None}
    while (above := parents.get(frame)) is not None and above not in path:
        path[above] = None
        frame = above
    return list(path)


def _each_once(texts: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(texts))
