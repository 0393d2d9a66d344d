"""Chains: paths between two frames, found once and reused until the tree changes.

A chain replaces the search in `tree` for the usual case: every frame on the path has only one parent in its
whole history, so the path is the same at all times. Its results are bit-for-bit identical to those of `tree`.
If a chain gives no result, `tree` finds another path or the reason for the failure.

Programs often look up many transforms at the timestamp of one message: between all frames of a robot, or in
several callbacks. Two caches speed up these lookups. A chain keeps its last results. If consecutive lookups
are at the same time, each frame also keeps the pose that was interpolated for this time, for use by all
chains. A newer pose does not change the past, so only these events invalidate results: a pose older than its
frame's newest, a static pose, another parent, and `clear`. If poses are dropped because of their age, only
results for earlier times become unavailable.
"""

from __future__ import annotations

from bisect import bisect_right

from pipros_libraries.transforms.history import FrameHistory
from pipros_libraries.transforms.pose import Pose, interpolate, joined
from pipros_libraries.transforms.tree import MAX_DEPTH, Frames

CHAIN_BYTES = 1_600
"""Estimated memory per pair of frames and its results, excluding its steps."""

_STEP_BYTES = 100

_MAX_RESULTS = 4
"""Maximum number of results that a chain keeps."""

_Frame = tuple[list[int], list[Pose], list[tuple[int, Pose]]]
"""The lists `stamps`, `poses` and `interpolated` of a `FrameHistory`."""


class LookupTimes:
    """The state of a buffer that determines whether its chains can reuse results.

    Attributes:
        last: time of the buffer's last lookup.
        changes: number of events that invalidated results.
        kept_since: time before which results may be unavailable, because poses were dropped.
    """

    __slots__ = ("changes", "kept_since", "last")

    def __init__(self) -> None:
        self.last = -1
        self.changes = 0
        self.kept_since = 1  # so that results for 0, the latest time, are not reused


class Chain:
    """The frames from a source and from a target up to a common ancestor.

    Valid until the `only_parent` of a frame in the buffer changes. Not thread-safe; the caller holds a lock.

    Attributes:
        size_bytes: estimated memory.
    """

    __slots__ = ("_changes", "_common", "_down", "_moving", "_results", "_times", "_up", "size_bytes")

    def __init__(self, up: list[FrameHistory], down: list[FrameHistory], times: LookupTimes) -> None:
        # Reading the lists of each frame's history directly saves one call per frame in each lookup.
        self._up = [(frame.stamps, frame.poses, frame.interpolated) for frame in up]
        self._down = [(frame.stamps, frame.poses, frame.interpolated) for frame in down]
        self._times = times
        self._changes = times.changes  # the number of changes when the results were stored
        self._results: dict[int, Pose] = {}
        self._moving = [frame.stamps for frame in up + down if frame.stamps]
        # Frames above the first common ancestor are in both lists. As in tf2, they do not affect the latest
        # common time.
        below = set(up) ^ set(down)
        self._common = [frame.stamps for frame in below if frame.stamps]
        self.size_bytes = CHAIN_BYTES + _STEP_BYTES * (len(up) + len(down))

    def latest_common_time(self) -> int:
        """Return the latest time at which all moving frames have a pose, or 0 if no frame moves.

        Frames above the first common ancestor do not count.
        """
        return min([stamps[-1] for stamps in self._common if stamps[-1]], default=0)

    def is_available(self, time: int) -> bool:
        """Return whether all frames have a pose at `time`."""
        for stamps in self._moving:  # noqa: SIM110 # `all` takes twice as long
            if not stamps[0] <= time <= stamps[-1]:
                return False
        return True

    def pose(self, time: int) -> Pose | None:
        """Return the pose of the source relative to the target at `time`, or None if it is not available."""
        times, results = self._times, self._results
        if self._changes != times.changes:
            results.clear()
            self._changes = times.changes
        if time >= times.kept_since and (pose := results.get(time)) is not None:
            return pose
        is_again, times.last = time == times.last, time
        up = _poses_at(self._up, time, is_again)
        down = _poses_at(self._down, time, is_again)
        if up is None or down is None:
            return None
        if len(results) == _MAX_RESULTS:
            results.clear()
        pose = results[time] = joined(up, down)
        return pose


def _poses_at(frames: list[_Frame], time: int, keeps: bool) -> list[Pose] | None:
    """Return the pose of each frame at `time`, or None if one is not available.

    If `keeps` is true, interpolated poses are kept for the next lookup.
    """
    found = []
    after, older, newer, ratio = 0, -1, -1, 0.0
    for stamps, poses, interpolated in frames:
        if not stamps:  # a static frame
            found.append(poses[0])
            continue
        # Frames that were sent together have the same stamps, so that the last frame's place is tried first.
        if not (after < len(stamps) and stamps[after - 1] == older and stamps[after] == newer):
            if not stamps[0] <= time <= stamps[-1]:
                return None
            if time == stamps[-1] or time == 0:
                found.append(poses[-1])
                continue
            after = bisect_right(stamps, time)
            older, newer = stamps[after - 1], stamps[after]
            ratio = (time - older) / (newer - older)
        if keeps and interpolated and interpolated[0][0] == time:
            found.append(interpolated[0][1])
            continue
        pose = interpolate(poses[after - 1], poses[after], ratio)
        if keeps:
            interpolated[:] = [(time, pose)]
        found.append(pose)
    return found


def find_chain(frames: Frames, target: str, source: str, times: LookupTimes) -> Chain | None:
    """Return the chain between two frames, or None if they are not connected or the path varies over time."""
    up: list[FrameHistory] = []
    name = source
    while name != target and (frame := frames[name]) is not None:
        if frame.only_parent is None or len(up) == MAX_DEPTH:
            return None
        up.append(frame)
        name = frame.only_parent
    top = name
    down: list[FrameHistory] = []
    name = target
    while name != top:
        if name == source:
            return Chain([], down, times)
        frame = frames[name]
        if frame is None or frame.only_parent is None or len(down) == MAX_DEPTH:
            return None
        down.append(frame)
        name = frame.only_parent
    return Chain(up, down, times)
