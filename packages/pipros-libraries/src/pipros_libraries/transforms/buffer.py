"""A buffer for transforms over time, with the same lookups and error texts as tf2's buffer.

Times are in nanoseconds; 0 means the latest common time. All methods may be called from any thread. No
method waits for a transform; see `TransformBuffer.waiter`.
"""

from __future__ import annotations

from threading import Lock

from pipros.basics.printable import printable
from pipros.msg.time import NS_PER_S
from pipros_libraries.transforms.chain import CHAIN_BYTES, Chain, LookupTimes, find_chain
from pipros_libraries.transforms.errors import (
    ConnectivityException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from pipros_libraries.transforms.formatting import (
    edges,
    frames_as_dot,
    frames_as_html,
    frames_as_string,
    frames_as_yaml,
)
from pipros_libraries.transforms.history import MovingFrame, StaticFrame
from pipros_libraries.transforms.pose import IDENTITY, Pose, compose_via_matrices
from pipros_libraries.transforms.tree import Frames, find_path, latest_common_time
from pipros_libraries.transforms.waiter import TransformWaiter

TRANSFORM_CHAINS_BYTES = 4 * 1024 * 1024
"""Limit: the approximate size of the paths between frames that one tf buffer remembers. Beyond it, the tf
buffer discards all cached paths between frames, and searches each again at its next lookup.
"""
TRANSFORM_BYTES = 1024 * 1024 * 1024
"""Limit: the approximate size of the frames and transforms in one tf buffer. Beyond it, a new frame is
refused (`TF_NO_ROOM`); an existing frame loses the older half of its transforms.
"""

DEFAULT_LENGTH = 10 * NS_PER_S
_FRAME_BYTES = 1_000
"""Estimated memory per frame, excluding its name and its transforms."""

_SHOWN = 200
NORM_TOLERANCE = 10e-3
"""Maximum deviation of a quaternion's squared norm from 1."""


class TransformBuffer:
    """Buffer for static transforms and for the transforms of the last `length` nanoseconds.

    `limit_bytes` limits the total size of all transforms. If a new transform would exceed it, the
    older half of its frame's transforms is dropped; if the transform would also add a frame, it is rejected.

    Attributes:
        waiter: lets threads wait for transforms in this buffer.
    """

    def __init__(self, length: int = DEFAULT_LENGTH, limit_bytes: int | None = None) -> None:
        self.length = length
        self._limit_bytes = TRANSFORM_BYTES if limit_bytes is None else limit_bytes
        self._chains_limit_bytes = TRANSFORM_CHAINS_BYTES
        self._size_bytes = 0
        self._lock = Lock()
        self._frames: Frames = {}
        self._chains: dict[tuple[str, str], Chain | None] = {}
        self._chains_bytes = 0
        self._times = LookupTimes()
        self.waiter = TransformWaiter()

    def insert(
        self, parent: str, child: str, stamp: int, pose: Pose, authority: str, is_static: bool = False
    ) -> list[str]:
        """Add the pose of a frame relative to its parent.

        Return the reasons for rejecting it, or an empty list.

        `authority` is the name of the publishing node. A leading slash is removed from `parent` and `child`.
        As in tf2, the first transform of a frame decides whether the frame is static.
        """
        if parent[:1] == "/":
            parent = parent[1:]
        if child[:1] == "/":
            child = child[1:]
        px, py, pz, qx, qy, qz, qw = pose
        norm = qx * qx + qy * qy + qz * qz + qw * qw
        # NaN fails every comparison, so this rejects NaN and wrong or infinite norms. An infinite
        # translation is accepted, as in tf2.
        if not (-NORM_TOLERANCE < norm - 1.0 < NORM_TOLERANCE and px == px and py == py and pz == pz):
            return _rejections(parent, child, pose, authority, stamp)
        if parent == child or not parent or not child or stamp < 0:
            return _rejections(parent, child, pose, authority, stamp)
        with self._lock:
            frames = self._frames
            frame = frames.get(child)
            if frame is None or parent not in frames:
                added = sum(_FRAME_BYTES + len(name) for name in (parent, child) if name not in frames)
                if self._size_bytes + added > self._limit_bytes:
                    what = f"TF_NO_ROOM there are too many transforms for frame {printable(child, _SHOWN)}"
                    return [f"{what}: the limit is {self._limit_bytes} bytes"]
                self._size_bytes += added
                if frame is None:
                    frame = StaticFrame() if is_static else MovingFrame(self.length)
                    frames[child] = frame
                if parent not in frames:
                    frames[parent] = None
            before, only_parent, stamps = frame.size_bytes, frame.only_parent, frame.stamps
            refusal = frame.insert(stamp, parent, pose)
            size = self._size_bytes = self._size_bytes + frame.size_bytes - before
            if size > self._limit_bytes:
                before = frame.size_bytes
                frame.drop_oldest()
                self._size_bytes += frame.size_bytes - before
            times = self._times
            if stamps and stamps[0] > times.kept_since:
                times.kept_since = stamps[0]
            if frame.only_parent is not only_parent:
                self._forget_chains()
            if refusal is None:
                frame.authority = authority
                if not stamps or stamps[-1] != stamp:  # the pose replaced one, or is before another
                    times.changes += 1
        if refusal is None:
            if self.waiter.waiting:
                self.waiter.notify()
            return []
        return [
            f"{refusal} for frame {child} (parent {parent}) at time {stamp / NS_PER_S:.6f} "
            f"according to authority {authority}"
        ]

    def clear(self) -> None:
        """Remove all transforms except static ones."""
        with self._lock:
            self._forget_chains()
            self._times = LookupTimes()
            for frame in self._frames.values():
                if frame is not None:
                    before = frame.size_bytes
                    frame.clear()
                    self._size_bytes += frame.size_bytes - before

    def lookup(self, target: str, source: str, time: int) -> tuple[int, Pose]:
        """Return the transform's time, and the pose of `source` relative to `target` at that time.

        Raises:
            InvalidArgumentException: a frame ID is empty or starts with a slash.
            LookupException: a frame is unknown, or the frames form a loop.
            ConnectivityException: the frames are not connected.
            ExtrapolationException: a transform on the path is not available at this time.
        """
        with self._lock:
            frames = self._frames
            if target == source:
                if time == 0 and (frame := frames.get(target)) is not None:
                    time = frame.latest()[0]
                return time, IDENTITY
            if target not in frames or source not in frames:
                self._require(target, "lookupTransform argument target_frame")
                self._require(source, "lookupTransform argument source_frame")
            if (chain := self._chain(target, source)) is not None:
                at = time or chain.latest_common_time()
                if (pose := chain.pose(at)) is not None:
                    return at, pose
            path = find_path(frames, target, source, time)
            return path.time, path.pose()

    def lookup_full(
        self, target: str, target_time: int, source: str, source_time: int, fixed: str
    ) -> tuple[int, Pose]:
        """Like `lookup`, but with the source at `source_time` and the target at `target_time`.

        `fixed` must not move between these times. The returned time is the target time.
        """
        with self._lock:
            self._require(target, "lookupTransform argument target_frame")
            self._require(source, "lookupTransform argument source_frame")
            self._require(fixed, "lookupTransform argument fixed_frame")
        _, in_fixed = self.lookup(fixed, source, source_time)
        time, in_target = self.lookup(target, fixed, target_time)
        return time, compose_via_matrices(in_target, in_fixed)

    def can_transform(self, target: str, source: str, time: int) -> str | None:
        """Return None if `lookup` would succeed, otherwise the reason as worded by tf2.

        Raises:
            InvalidArgumentException: a frame ID is empty or starts with a slash.
        """
        if target == source:
            return None
        with self._lock:
            frames = self._frames
            if target not in frames or source not in frames:
                _check(target, "canTransform argument target_frame")
                _check(source, "canTransform argument source_frame")
                return " ".join(
                    f"canTransform: {role} {name} does not exist."
                    for role, name in (("target_frame", target), ("source_frame", source))
                    if name not in frames
                )
            chain = self._chain(target, source)
            if chain is not None and chain.is_available(time or chain.latest_common_time()):
                return None
            try:
                find_path(frames, target, source, time)
            except TransformException as error:
                return str(error)
            return None

    def can_transform_full(
        self, target: str, target_time: int, source: str, source_time: int, fixed: str
    ) -> str | None:
        """Return None if `lookup_full` would succeed, otherwise the reason as worded by tf2.

        Raises:
            InvalidArgumentException: a frame ID is empty or starts with a slash.
        """
        _check(target, "canTransform argument target_frame")
        _check(source, "canTransform argument source_frame")
        _check(fixed, "canTransform argument fixed_frame")
        with self._lock:
            unknown = {name for name in (target, source, fixed) if name not in self._frames}
            if unknown:
                reasons = []
                if target in unknown:
                    reasons.append(f"canTransform: target_frame {target} does not exist.")
                if source in unknown:
                    reasons.append(f"canTransform: source_frame {source} does not exist.")
                    # As in tf2, this is reported even if the fixed frame exists.
                    reasons.append(f"fixed_frame: {fixed}does not exist.")
                return " ".join(reasons)
            try:
                find_path(self._frames, target, fixed, target_time)
                find_path(self._frames, fixed, source, source_time)
            except TransformException as error:
                return str(error)
            return None

    def latest_common_time(self, target: str, source: str) -> int:
        """Return the latest time at which a transform between the frames is available.

        Return 0 if all transforms between them are static.

        Raises:
            InvalidArgumentException: a frame ID is empty or starts with a slash.
            LookupException: a frame is unknown.
            TransformException: the frames are not connected, or form a loop.
        """
        with self._lock:
            self._require(target, "get_latest_common_time")
            self._require(source, "get_latest_common_time")
            try:
                return latest_common_time(self._frames, target, source)
            except (ConnectivityException, LookupException) as error:
                raise TransformException(str(error)) from None

    def chain(self, target: str, target_time: int, source: str, source_time: int, fixed: str) -> list[str]:
        """Return the frames on the path from `source` via `fixed` to `target`.

        Raises:
            LookupException: a frame is unknown, or the frames form a loop.
            ConnectivityException: the frames are not connected.
            ExtrapolationException: a transform on the path is not available at the given time.
        """
        with self._lock:
            if not {target, source, fixed} <= self._frames.keys():
                raise LookupException("")
            first = find_path(self._frames, fixed, source, source_time).frame_names()
            second = find_path(self._frames, target, fixed, target_time).frame_names()
        return first + second[1:] if first else second

    def frame_exists(self, name: str) -> bool:
        """Return whether the frame has occurred in any transform."""
        with self._lock:
            return name in self._frames

    def frame_names(self) -> list[str]:
        """Return the names of all frames, in the order in which they were first seen."""
        with self._lock:
            return list(self._frames)

    def as_string(self) -> str:
        """Return one line for each frame except roots, naming the frame and its parent."""
        with self._lock:
            return frames_as_string(self._frames)

    def _repr_html_(self) -> str:
        """Return the frame tree for notebooks."""
        with self._lock:
            return frames_as_html(self._frames)

    def as_yaml(self) -> str:
        """Return all frames with a parent as YAML, in the format of the service `tf2_frames`."""
        with self._lock:
            return frames_as_yaml(self._frames)

    def as_dot(self, now: float | None = None) -> str:
        """Return the frame tree in the DOT language. If `now` (s) is given, include the transforms' ages."""
        with self._lock:
            return frames_as_dot(self._frames, now)

    def edges(self) -> list[tuple[str, str, str, float]]:
        """Return the parent, child, publishing node and rate in Hz for each frame with known transforms."""
        with self._lock:
            return edges(self._frames)

    def _chain(self, target: str, source: str) -> Chain | None:
        """Return the chain between two known frames, or None, and cache it. The caller must hold the lock."""
        pair = target, source
        try:
            return self._chains[pair]
        except KeyError:
            chain = find_chain(self._frames, target, source, self._times)
            self._chains_bytes += CHAIN_BYTES if chain is None else chain.size_bytes
            if self._chains_bytes > self._chains_limit_bytes:
                self._forget_chains()
            self._chains[pair] = chain
            return chain

    def _forget_chains(self) -> None:
        self._chains.clear()
        self._chains_bytes = 0

    def _require(self, name: str, what: str) -> None:
        """Raise InvalidArgumentException if the frame ID is invalid, LookupException if it is unknown."""
        if name not in self._frames:
            _check(name, what)
            raise LookupException(f'"{name}" passed to {what} does not exist. ')


def _check(name: str, what: str) -> None:
    """Raise InvalidArgumentException for a frame ID that is empty or starts with a slash."""
    if not name:
        raise InvalidArgumentException(f"Invalid argument passed to {what} in tf2 frame_ids cannot be empty")
    if name[0] == "/":
        raise InvalidArgumentException(
            f"Invalid argument \"{name}\" passed to {what} in tf2 frame_ids cannot start with a '/' like: "
        )


def _rejections(parent: str, child: str, pose: Pose, authority: str, stamp: int) -> list[str]:
    """Return every reason to reject a transform."""
    found = []
    if parent == child:
        found.append(f"TF_SELF_TRANSFORM: frame_id and child_frame_id must differ, both are {child!r}")
    if not child:
        found.append("TF_NO_CHILD_FRAME_ID: child_frame_id must be set")
    if not parent:
        found.append(f"TF_NO_FRAME_ID: frame_id must be set for child_frame_id {child!r}")
    numbers = " ".join(f"{number:.6f}" for number in pose)
    if any(number != number for number in pose):
        found.append(
            f"TF_NAN_INPUT: translation and rotation of {child!r} must not contain NaN, got ({numbers})"
        )
    norm = sum(number * number for number in pose[3:])
    if not abs(norm - 1.0) < NORM_TOLERANCE:
        found.append(
            f"TF_DENORMALIZED_QUATERNION: the quaternion of {child!r} must have norm 1, got ({numbers})"
        )
    if stamp < 0:
        found.append(f"TF_NEGATIVE_TIME: the stamp of {child!r} must be >= 0, got {stamp / NS_PER_S:.9f}")
    return [f'{reason}; ignored transform from authority "{authority}"' for reason in found]
