"""Chains: the frames between two frames, found once and reused until the tree changes.

A chain replaces the search in `tree` for the usual case: every frame on the path has only one parent in its
whole history, so the path is the same at all times. Its results are equal to those of `tree`, bit for bit.
If a chain gives no result, `tree` finds another path or the reason for the failure.
"""

from __future__ import annotations

from pipros.libraries.transforms.history import FrameHistory, MovingFrame
from pipros.libraries.transforms.pose import Pose, joined
from pipros.libraries.transforms.tree import MAX_DEPTH, Frames

CHAIN_BYTES = 800
"""Estimated memory per pair of frames, excluding its steps."""

_STEP_BYTES = 32


class Chain:
    """The frames from a source and from a target up to the same frame.

    Valid until the `only_parent` of a frame in the buffer changes. Not thread-safe; the caller holds a lock.

    Attributes:
        size_bytes: estimated memory.
    """

    __slots__ = ("_common", "_down", "_stamps", "_up", "size_bytes")

    def __init__(self, up: list[FrameHistory], down: list[FrameHistory]) -> None:
        self._up = up
        self._down = down
        self._stamps = [frame.stamps for frame in up + down if isinstance(frame, MovingFrame)]
        # Frames above the first common ancestor are in both parts. As in tf2, they are ignored here.
        below = set(up) ^ set(down)
        self._common = [frame.stamps for frame in below if isinstance(frame, MovingFrame)]
        self.size_bytes = CHAIN_BYTES + _STEP_BYTES * (len(up) + len(down))

    def latest_common_time(self) -> int:
        """Return the latest time at which all moving frames have a pose; 0 if all frames are static."""
        return min([stamps[-1] for stamps in self._common if stamps[-1]], default=0)

    def is_available(self, time: int) -> bool:
        """Return whether all frames have a pose at `time`."""
        for stamps in self._stamps:  # noqa: SIM110 # `all` takes twice as long
            if not stamps[0] <= time <= stamps[-1]:
                return False
        return True

    def pose(self, time: int) -> Pose | None:
        """Return the pose of the source relative to the target at `time`, or None if it is not available."""
        if not self.is_available(time):
            return None
        return joined(
            [frame.pose_at(time) for frame in self._up], [frame.pose_at(time) for frame in self._down]
        )


def find_chain(frames: Frames, target: str, source: str) -> Chain | None:
    """Return the chain between two frames; None if they are not connected or the path depends on the time."""
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
            return Chain([], down)
        frame = frames[name]
        if frame is None or frame.only_parent is None or len(down) == MAX_DEPTH:
            return None
        down.append(frame)
        name = frame.only_parent
    return Chain(up, down)
