"""The transforms that a navigation node receives."""

from __future__ import annotations

import logging
import time
from typing import Final

from pipros.libraries.transforms.errors import TransformException
from pipros.libraries.transforms.listener import TransformListener
from pipros.libraries.transforms.pose import Pose
from pipros.node import Node

_WARNING_S: Final = 2.0


class Frames(TransformListener):
    """Lookups for navigation, which warn if a transform is missing, at most every two seconds."""

    def __init__(self, node: Node, log: logging.Logger) -> None:
        """Subscribe. Blocks until the master answers."""
        self._log = log
        self._warned_s = -_WARNING_S
        super().__init__(node)
        self.problems = self._warn

    def find(self, target: str, source: str, stamp_ns: int, timeout_s: float = 0.0) -> Pose | None:
        """Return the pose of `source` in `target` at a time, or the latest one with a warning, or None.

        Wait up to `timeout_s` of the node's time for the pose at the time.
        """
        try:
            return self.at(target, source, stamp_ns, timeout_s)
        except TransformException as error:
            reason = str(error)
        try:
            _, pose = self.buffer.lookup(target, source, 0)
        except TransformException:
            if target != source:
                self._warn(f"no transform from {source} to {target}: {reason}")
            return None
        self._warn(f"no transform from {source} to {target} at the requested time; using the latest")
        return pose

    def awaited(self, target: str, source: str, stamp_ns: int, timeout_s: float) -> Pose | None:
        """Return the pose of `source` in `target` at a time, or None with a warning if it is not known.

        Wait up to `timeout_s` of the node's time, but not for a time that is older than the known ones.
        """
        reason: list[str | None] = [None]

        def ask() -> tuple[int, str]:
            reason[0] = self.buffer.can_transform(target, source, stamp_ns)
            if reason[0] is None or self._has_passed(target, source, stamp_ns):
                return 1, ""
            return 0, reason[0]

        try:
            self.buffer.waiter.wait(ask, round(timeout_s * 1e9), lambda: self._node.clock, self._check)
            return self.buffer.lookup(target, source, stamp_ns)[1]
        except TransformException as error:
            self._warn(f"no transform from {source} to {target}: {error}")
            return None

    def latest(self, target: str, source: str) -> Pose | None:
        """Return the latest pose of `source` in `target`, or None if it is not known."""
        try:
            return self.buffer.lookup(target, source, 0)[1]
        except TransformException:
            return None

    def motion(self, frame: str, fixed: str, since_ns: int, until_ns: int, timeout_s: float) -> Pose | None:
        """Return the pose of a frame relative to its earlier pose, or None if it is not known in time."""

        def ask() -> tuple[int, str]:
            reason = self.buffer.can_transform_full(frame, since_ns, frame, until_ns, fixed)
            return (1, "") if reason is None else (0, reason)

        try:
            self.buffer.waiter.wait(ask, round(timeout_s * 1e9), lambda: self._node.clock, self._check)
            return self.buffer.lookup_full(frame, since_ns, frame, until_ns, fixed)[1]
        except TransformException:
            return None

    def _has_passed(self, target: str, source: str, stamp_ns: int) -> bool:
        try:
            return self.buffer.latest_common_time(target, source) >= stamp_ns
        except TransformException:
            return False

    def _warn(self, text: str) -> None:
        if time.monotonic() - self._warned_s >= _WARNING_S:
            self._warned_s = time.monotonic()
            self._log.warning("%s", text)
