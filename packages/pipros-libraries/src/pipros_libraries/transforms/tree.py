"""The frame tree, and the path from one frame to another at a given time.

A frame without a parent is a root. Checks are made, and errors raised, in the same order as in tf2.
"""

from __future__ import annotations

from pipros_libraries.transforms.errors import ConnectivityException, ExtrapolationException, LookupException
from pipros_libraries.transforms.formatting import frames_as_string
from pipros_libraries.transforms.history import FrameHistory
from pipros_libraries.transforms.pose import Pose, joined

MAX_DEPTH = 1000
"""Maximum number of frames on a path. As in tf2, a longer path is reported as a loop."""

LISTING_CHARACTERS = 10_000
"""Maximum length of the frame list in an error.

tf2 lists all frames, regardless of the cost for each lookup.
"""

Step = tuple[FrameHistory, int]
"""A frame on a path, and the index of its pose (`FrameHistory.locate`)."""

Frames = dict[str, FrameHistory | None]
"""All frames with their histories, in the order in which they were first seen.

The history of a root is None.
"""


class Path:
    """The path from a frame up to a common ancestor, and down to another frame.

    Attributes:
        time: lookup time in ns; the latest common time if 0 was requested.
        up, down: the steps up from the source and from the target.
        names: the frames of `up` and of `down`.
    """

    __slots__ = ("down", "names", "time", "up")

    def __init__(
        self, time: int, up: list[Step], down: list[Step], names: tuple[list[str], list[str]]
    ) -> None:
        self.time = time
        self.up = up
        self.down = down
        self.names = names

    def pose(self) -> Pose:
        """Return the pose of the source relative to the target."""
        time = self.time
        return joined(
            [frame.pose(number, time) for frame, number in self.up],
            [frame.pose(number, time) for frame, number in self.down],
        )

    def frame_names(self) -> list[str]:
        """Return the frames from source to target, inclusive, or an empty list if they are the same."""
        up, down = self.names
        if not down:
            return up
        if not up:
            return down[::-1]
        # Both lists may extend beyond the first common ancestor.
        while len(up) > 1 and len(down) > 1 and up[-2] == down[-2]:
            up, down = up[:-1], down[:-1]
        return up + down[-2::-1]


def find_path(frames: Frames, target: str, source: str, time: int) -> Path:
    """Return the path from source to target at a time in nanoseconds, where 0 means the latest common time.

    Raises:
        LookupException: the frames form a loop.
        ConnectivityException: the frames are not connected.
        ExtrapolationException: a transform on the path is not available at this time.
    """
    if source == target:
        return Path(time, [], [], ([], []))
    if time == 0:
        time = latest_common_time(frames, target, source)
    up: list[Step] = []
    up_names: list[str] = []
    interrupted: FrameHistory | None = None
    name = source
    while True:
        frame = frames[name]
        up_names.append(name)
        if frame is None:
            break
        number = frame.locate(time)
        if number < 0:
            interrupted = frame
            break
        if name == target:
            return Path(time, up, [], (up_names, []))
        up.append((frame, number))
        if len(up) > MAX_DEPTH:
            raise _loop(frames)
        name = frame.parents[number]
    top = name

    down: list[Step] = []
    down_names: list[str] = []
    name = target
    while name != top:
        frame = frames[name]
        down_names.append(name)
        if frame is None:
            break
        number = frame.locate(time)
        if number < 0:
            raise ExtrapolationException(f"{frame.why_not(time)}{_requested(source, target)}")
        if name == source:
            return Path(time, [], down, ([], down_names))
        down.append((frame, number))
        if len(down) > MAX_DEPTH:
            raise _loop(frames)
        name = frame.parents[number]
    if name != top:
        if interrupted is not None:
            raise ExtrapolationException(f"{interrupted.why_not(time)}{_requested(source, target)}")
        raise _not_connected(target, source)
    return Path(time, up, down, (up_names, [*down_names, top]))


def latest_common_time(frames: Frames, target: str, source: str) -> int:
    """Return the latest time at which a transform between the frames is available, in nanoseconds.

    Return 0 if all transforms on the path are static.

    Raises:
        LookupException: the frames form a loop.
        ConnectivityException: the frames are not connected.
    """
    if source == target:
        frame = frames[source]
        return 0 if frame is None else frame.latest()[0]
    common: int | None = None
    seen: list[tuple[int, str]] = []
    name = source
    while (frame := frames[name]) is not None:
        stamp, parent = frame.latest()
        if parent is None:
            break
        if stamp and (common is None or stamp < common):
            common = stamp
        seen.append((stamp, parent))
        name = parent
        if name == target:
            return common or 0
        if len(seen) > MAX_DEPTH:
            raise _loop(frames)

    above_source = {parent for _, parent in seen}
    common = None
    meeting: str | None = None
    name, depth = target, 0
    while (frame := frames[name]) is not None:
        stamp, parent = frame.latest()
        if parent is None:
            break
        if stamp and (common is None or stamp < common):
            common = stamp
        if parent in above_source:
            meeting = parent
            break
        name = parent
        if name == source:
            return common or 0
        depth += 1
        if depth > MAX_DEPTH:
            raise _loop(frames)
    if meeting is None:
        raise _not_connected(target, source)
    for stamp, parent in seen:
        if stamp and (common is None or stamp < common):
            common = stamp
        if parent == meeting:
            break
    return common or 0


def _requested(source: str, target: str) -> str:
    return f", when looking up transform from frame [{source}] to frame [{target}]"


def _not_connected(target: str, source: str) -> ConnectivityException:
    return ConnectivityException(
        f"Could not find a connection between '{target}' and '{source}' because they are not part of the "
        "same tree.Tf has two or more unconnected trees."
    )


def _loop(frames: Frames) -> LookupException:
    listing = frames_as_string(frames, LISTING_CHARACTERS)
    return LookupException(f"The tf tree is invalid because it contains a loop.\n{listing}\n")
