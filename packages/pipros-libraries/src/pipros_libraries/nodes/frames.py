"""The transforms that a navigation node receives."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Final

from pipros.basics.throttle import Throttle
from pipros.node import Node
from pipros_libraries.transforms.errors import TransformException
from pipros_libraries.transforms.listener import TransformListener
from pipros_libraries.transforms.pose import Pose

_MISSING: Final = "no transform from %s to %s: %s"


class Frames(TransformListener):
    """Transform lookups for navigation. Warns about missing transforms, at most every two seconds."""

    def __init__(self, node: Node, log: logging.Logger) -> None:
        """Subscribe to transforms. Blocks until the master answers."""
        self._log = Throttle(log, 2.0)
        super().__init__(node)
        self.problems = partial(self._log.warning, "%s")

    def find(self, target: str, source: str, stamp_ns: int, timeout_s: float = 0.0) -> Pose | None:
        """Return the pose of `source` in `target` at a time.

        Wait up to `timeout_s` on the node's clock. If the pose at this time is not available, warn and return
        the latest pose, or None if there is no pose.
        """
        try:
            return self.at(target, source, stamp_ns, timeout_s)
        except TransformException as error:
            reason = error
        latest = self.latest(target, source)
        if latest is not None:
            text = "no transform from %s to %s at the requested time; using the latest"
            self._log.warning(text, source, target)
        elif target != source:
            self._log.warning(_MISSING, source, target, reason)
        return latest

    def awaited(self, target: str, source: str, stamp_ns: int, timeout_s: float) -> Pose | None:
        """Return the pose of `source` in `target` at a time. If it is not available, warn and return None.

        Wait up to `timeout_s` on the node's clock, but not if later transforms have already arrived.
        """

        def reason() -> str | None:
            found = self.buffer.can_transform(target, source, stamp_ns)
            return None if found is not None and self._has_passed(target, source, stamp_ns) else found

        try:
            self._wait(reason, timeout_s)
            return self.buffer.lookup(target, source, stamp_ns)[1]
        except TransformException as error:
            self._log.warning(_MISSING, source, target, error)
            return None

    def _wait(self, reason: Callable[[], str | None], timeout_s: float) -> None:
        """Wait up to `timeout_s` until `reason` returns None."""

        def ask() -> tuple[int, str]:
            found = reason()
            return (1, "") if found is None else (0, found)

        self.buffer.waiter.wait(ask, round(timeout_s * 1e9), lambda: self._node.clock, self._check)

    def latest(self, target: str, source: str) -> Pose | None:
        """Return the latest pose of `source` in `target`, or None if there is none."""
        try:
            return self.buffer.lookup(target, source, 0)[1]
        except TransformException:
            return None

    def motion(self, frame: str, fixed: str, since_ns: int, until_ns: int, timeout_s: float) -> Pose | None:
        """Return a frame's pose at `until_ns` relative to its pose at `since_ns`.

        Return None if it is not available within `timeout_s`.
        """
        arguments = frame, since_ns, frame, until_ns, fixed
        try:
            self._wait(lambda: self.buffer.can_transform_full(*arguments), timeout_s)
            return self.buffer.lookup_full(*arguments)[1]
        except TransformException:
            return None

    def _has_passed(self, target: str, source: str, stamp_ns: int) -> bool:
        try:
            return self.buffer.latest_common_time(target, source) >= stamp_ns
        except TransformException:
            return False
