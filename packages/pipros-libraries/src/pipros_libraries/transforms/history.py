"""The poses of one frame relative to its parent over time.

Timestamps are in nanoseconds; 0 means the latest.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import Protocol

from pipros.msg.time import NS_PER_S
from pipros_libraries.transforms.pose import Pose, interpolate

_POSE_BYTES = 350
"""Estimated memory per pose, excluding the parent's name."""


class FrameHistory(Protocol):
    """The buffered poses of a frame. `locate` returns a pose's index, for use with `parents` and `pose`.

    Implementations are not thread-safe; the caller holds a lock.

    `stamps`, `parents`, `poses` and `interpolated` are always the same list objects, changed in place.

    Attributes:
        stamps: the timestamps of the poses in ascending order; empty for a static frame.
        parents, poses: the parent and the pose for each timestamp; one of each for a static frame.
        interpolated: one pair of a time and the pose that was interpolated for this time, or empty; see
            `Chain`.
        only_parent: the parent of all poses; None if there are no poses, or if they have several parents.
        authority: the node that published the last inserted pose.
        size_bytes: estimated memory used by the poses.
    """

    stamps: list[int]
    parents: list[str]
    poses: list[Pose]
    interpolated: list[tuple[int, Pose]]
    only_parent: str | None
    authority: str
    size_bytes: int

    def insert(self, stamp: int, parent: str, pose: Pose) -> str | None:
        """Add a pose. Return None, or the reason if the pose is rejected."""

    def locate(self, time: int) -> int:
        """Return the index of the last pose at or before `time`, or -1 if `time` is out of range."""

    def pose(self, number: int, time: int) -> Pose:
        """Return the pose at `time`. `number` is the result of `locate(time)`, which must not be -1."""

    def why_not(self, time: int) -> str:
        """Return why no pose is available at `time`."""

    def latest(self) -> tuple[int, str | None]:
        """Return the latest timestamp and the parent at that time, or (0, None) if empty."""

    def oldest_stamp(self) -> int:
        """Return the oldest timestamp, or 0 if empty."""

    def clear(self) -> None:
        """Remove all poses of a moving frame."""

    def drop_oldest(self) -> None:
        """Remove the older half of the poses. The latest pose is kept."""


class MovingFrame:
    """The poses of a moving frame in the last `length` nanoseconds, ordered by timestamp."""

    __slots__ = (
        "authority",
        "interpolated",
        "length",
        "only_parent",
        "parents",
        "poses",
        "size_bytes",
        "stamps",
    )

    def __init__(self, length: int) -> None:
        self.length = length
        self.authority = ""
        self.only_parent: str | None = None
        self.size_bytes = 0
        self.stamps: list[int] = []
        self.parents: list[str] = []
        self.poses: list[Pose] = []
        self.interpolated: list[tuple[int, Pose]] = []

    def insert(self, stamp: int, parent: str, pose: Pose) -> str | None:
        stamps = self.stamps
        if not stamps or stamp > stamps[-1]:
            stamps.append(stamp)
            self.parents.append(parent)
            self.poses.append(pose)
        else:
            if stamps[-1] > stamp + self.length:
                return (
                    "TF_OLD_DATA ignoring data from the past "
                    "(Possible reasons are listed at http://wiki.ros.org/tf/Errors%20explained)"
                )
            place = bisect_right(stamps, stamp)
            if place and stamps[place - 1] == stamp:
                return "TF_REPEATED_DATA ignoring data with redundant timestamp"
            self.interpolated.clear()
            stamps.insert(place, stamp)
            self.parents.insert(place, parent)
            self.poses.insert(place, pose)
        self.size_bytes += _POSE_BYTES + len(parent)
        if parent != self.only_parent:
            self.only_parent = parent if len(stamps) == 1 else None
        bound = stamps[-1] - self.length
        if stamps[0] < bound:
            count = 1
            while stamps[count] < bound:
                count += 1
            self._drop(count)
        return None

    def _drop(self, count: int) -> None:
        """Remove the `count` oldest poses."""
        for parent in self.parents[:count]:
            self.size_bytes -= _POSE_BYTES + len(parent)
        del self.stamps[:count], self.parents[:count], self.poses[:count]
        if self.only_parent is None and self.parents.count(self.parents[0]) == len(self.parents):
            self.only_parent = self.parents[0]

    def drop_oldest(self) -> None:
        self._drop(len(self.stamps) // 2)

    def locate(self, time: int) -> int:
        stamps = self.stamps
        if not stamps:
            return -1
        if time == 0:
            return len(stamps) - 1
        if stamps[0] <= time <= stamps[-1]:
            return bisect_right(stamps, time) - 1
        return -1

    def pose(self, number: int, time: int) -> Pose:
        older = self.stamps[number]
        if older == time or number + 1 == len(self.stamps):
            return self.poses[number]
        after = number + 1
        if self.parents[number] != self.parents[after]:
            return self.poses[number]  # keep the pose constant until the parent changes
        ratio = (time - older) / (self.stamps[after] - older)
        return interpolate(self.poses[number], self.poses[after], ratio)

    def why_not(self, time: int) -> str:
        if not self.stamps:
            return ""
        oldest, newest = self.stamps[0], self.stamps[-1]
        if oldest == newest:
            return (
                f"Lookup would require extrapolation at time {seconds(time)}, "
                f"but only time {seconds(newest)} is in the buffer"
            )
        where, word, known, gap = "past", "earliest", oldest, oldest - time
        if time > newest:
            where, word, known, gap = "future", "latest", newest, time - newest
        return (
            f"Lookup would require extrapolation {seconds(gap)}s into the {where}.  "
            f"Requested time {seconds(time)} but the {word} data is at time {seconds(known)}"
        )

    def latest(self) -> tuple[int, str | None]:
        return (self.stamps[-1], self.parents[-1]) if self.stamps else (0, None)

    def oldest_stamp(self) -> int:
        return self.stamps[0] if self.stamps else 0

    def clear(self) -> None:
        self.only_parent = None
        self.size_bytes = 0
        del self.stamps[:], self.parents[:], self.poses[:], self.interpolated[:]


class StaticFrame:
    """The pose of a static frame."""

    __slots__ = ("authority", "interpolated", "only_parent", "parents", "poses", "size_bytes", "stamps")

    def __init__(self) -> None:
        self.authority = ""
        self.only_parent: str | None = None
        self.size_bytes = 0
        self.stamps: list[int] = []
        self.parents: list[str] = []
        self.poses: list[Pose] = []
        self.interpolated: list[tuple[int, Pose]] = []

    def insert(self, stamp: int, parent: str, pose: Pose) -> str | None:  # noqa: ARG002 # valid for every time
        """Replace the pose. The new pose is never rejected."""
        self.only_parent = parent
        self.parents[:] = [parent]
        self.poses[:] = [pose]
        self.size_bytes = _POSE_BYTES + len(parent)
        return None

    def locate(self, time: int) -> int:  # noqa: ARG002 # valid for every time
        """Return 0, the index of the only pose, or -1 if there is none."""
        return 0 if self.parents else -1

    def pose(self, number: int, time: int) -> Pose:  # noqa: ARG002
        """Return the pose, which is the same for every time."""
        return self.poses[number]

    def why_not(self, time: int) -> str:  # noqa: ARG002
        """Return an empty string, because the pose is available at every time."""
        return ""

    def latest(self) -> tuple[int, str | None]:
        """Return 0 and the parent. The timestamp is 0, because the pose is valid at any time."""
        return (0, self.parents[0] if self.parents else None)

    def oldest_stamp(self) -> int:
        """Return 0, because the pose has no timestamp."""
        return 0

    def drop_oldest(self) -> None:
        """Do nothing, because there is only one pose."""

    def clear(self) -> None:
        """Do nothing, because static transforms are kept."""


def seconds(time: int) -> str:
    """Format a time in nanoseconds as tf2 does: in seconds, with nine decimals."""
    return f"{time // NS_PER_S}.{time % NS_PER_S:09d}"
