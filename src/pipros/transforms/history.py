"""The poses of one frame in its parent over time. Stamps are nanoseconds; 0 means the newest."""

from __future__ import annotations

from bisect import bisect_right
from typing import Protocol

from pipros.msg.time import NS_PER_S
from pipros.transforms.pose import Pose, between

_POSE_BYTES = 350
"""What a pose takes in memory, besides the name of its parent."""


class FrameHistory(Protocol):
    """The known poses of a frame: `locate` finds one for a time, `parents` and `pose` return its parts.

    Attributes:
        size_bytes: what its poses take in memory, roughly.
    """

    parents: list[str]
    authority: str
    size_bytes: int

    def insert(self, stamp: int, parent: str, pose: Pose) -> str | None:
        """Takes a pose. Returns why not, if it is refused."""

    def locate(self, time: int) -> int:
        """The number of the pose to begin with for this time, -1 where nothing is known."""

    def pose(self, number: int, time: int) -> Pose:
        """The pose at a time for which `locate` gave the number."""

    def why_not(self, time: int) -> str:
        """Why nothing is known for this time."""

    def latest(self) -> tuple[int, str | None]:
        """The newest stamp and the parent then; no parent where nothing is known."""

    def oldest_stamp(self) -> int:
        """The oldest stamp, 0 where nothing is known."""

    def clear(self) -> None:
        """Forgets all poses."""

    def drop_oldest(self) -> None:
        """Forgets half of the poses, the oldest ones; the newest stays."""


class MovingFrame:
    """The poses of a frame that moves, as long as `length` nanoseconds before its newest one."""

    __slots__ = ("authority", "length", "parents", "poses", "size_bytes", "stamps")

    def __init__(self, length: int) -> None:
        self.length = length
        self.authority = ""
        self.size_bytes = 0
        self.stamps: list[int] = []
        self.parents: list[str] = []
        self.poses: list[Pose] = []

    def insert(self, stamp: int, parent: str, pose: Pose) -> str | None:
        """Takes a pose. Returns why not, if it is refused."""
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
            stamps.insert(place, stamp)
            self.parents.insert(place, parent)
            self.poses.insert(place, pose)
        self.size_bytes += _POSE_BYTES + len(parent)
        bound = stamps[-1] - self.length
        if stamps[0] < bound:
            count = 1
            while stamps[count] < bound:
                count += 1
            self._drop(count)
        return None

    def _drop(self, count: int) -> None:
        """Forgets the oldest poses."""
        for parent in self.parents[:count]:
            self.size_bytes -= _POSE_BYTES + len(parent)
        del self.stamps[:count], self.parents[:count], self.poses[:count]

    def drop_oldest(self) -> None:
        """Forgets half of the poses, the oldest ones; the newest stays."""
        self._drop(len(self.stamps) // 2)

    def locate(self, time: int) -> int:
        """The number of the pose to begin with for this time, -1 where nothing is known."""
        stamps = self.stamps
        if not stamps:
            return -1
        if time == 0:
            return len(stamps) - 1
        if stamps[0] <= time <= stamps[-1]:
            return bisect_right(stamps, time) - 1
        return -1

    def pose(self, number: int, time: int) -> Pose:
        """The pose at a time for which `locate` gave the number."""
        older = self.stamps[number]
        if older == time or number + 1 == len(self.stamps):
            return self.poses[number]
        after = number + 1
        if self.parents[number] != self.parents[after]:
            return self.poses[number]  # on its way to another parent it stays where it was
        ratio = (time - older) / (self.stamps[after] - older)
        return between(self.poses[number], self.poses[after], ratio)

    def why_not(self, time: int) -> str:
        """Why nothing is known for this time."""
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
        """The newest stamp and the parent then; no parent where nothing is known."""
        return (self.stamps[-1], self.parents[-1]) if self.stamps else (0, None)

    def oldest_stamp(self) -> int:
        """The oldest stamp, 0 where nothing is known."""
        return self.stamps[0] if self.stamps else 0

    def clear(self) -> None:
        """Forgets all poses."""
        self.size_bytes = 0
        del self.stamps[:], self.parents[:], self.poses[:]


class StaticFrame:
    """The pose of a frame that never moves."""

    __slots__ = ("_pose", "authority", "parents", "size_bytes")

    def __init__(self) -> None:
        self.authority = ""
        self.size_bytes = 0
        self.parents: list[str] = []
        self._pose: Pose | None = None

    def insert(self, stamp: int, parent: str, pose: Pose) -> str | None:  # noqa: ARG002 # no stamp counts
        """Takes a pose, which replaces the one before."""
        self.parents = [parent]
        self.size_bytes = _POSE_BYTES + len(parent)
        self._pose = pose
        return None

    def locate(self, time: int) -> int:  # noqa: ARG002 # for every time
        """The number of the only pose."""
        return 0 if self.parents else -1

    def pose(self, number: int, time: int) -> Pose:  # noqa: ARG002
        """The pose."""
        assert self._pose is not None  # noqa: S101 # `locate` found it
        return self._pose

    def why_not(self, time: int) -> str:  # noqa: ARG002
        """Nothing: the pose is known for every time."""
        return ""

    def latest(self) -> tuple[int, str | None]:
        """0, which says that it is not bound to a time, and the parent."""
        return (0, self.parents[0] if self.parents else None)

    def oldest_stamp(self) -> int:
        """Always 0."""
        return 0

    def drop_oldest(self) -> None:
        """Does nothing: there is one pose."""

    def clear(self) -> None:
        """Nothing: what never moves stays known."""


def seconds(time: int) -> str:
    """Nanoseconds as tf2 prints times: seconds with nine decimals."""
    return f"{time // NS_PER_S}.{time % NS_PER_S:09d}"
