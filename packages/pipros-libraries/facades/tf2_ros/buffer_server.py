"""`BufferServer`, which offers lookups in a buffer to other nodes, like the server in roscpp's tf2_ros."""

from __future__ import annotations

from threading import Lock
from typing import Any

from tf2_msgs.msg import LookupTransformAction, LookupTransformResult, TF2Error

import rospy
from actionlib import ActionServer
from tf2_py import TransformException
from tf2_ros.buffer_client import ERRORS

_CHECK_PERIOD = rospy.Duration(0.01)

_CODES = {kind: code for code, kind in ERRORS.items()}


class BufferServer:
    """Action server `ns` for lookups in `buffer`.

    Args:
        auto_start: whether to start immediately. If False, call `start`.
        check_period: interval between retries of pending lookups; 0.01 s by default.
    """

    def __init__(
        self, buffer: Any, ns: str, auto_start: bool = True, check_period: Any = _CHECK_PERIOD
    ) -> None:
        self.buffer = buffer
        self._lock = Lock()
        self._pending: list[tuple[Any, rospy.Time]] = []
        self._server = ActionServer(ns, LookupTransformAction, self._on_goal, self._on_cancel, False)
        self._timer = rospy.Timer(check_period, lambda _: self.check(), reset=True)
        if auto_start:
            self.start()

    def start(self) -> None:
        """Start accepting goals."""
        self._server.start()

    def stop(self) -> None:
        """Stop accepting goals. Pending goals are not completed."""
        self._timer.shutdown()
        self._server.stop()

    def check(self) -> None:
        """Complete the pending goals whose transform is available or whose timeout has expired.

        Called by a timer.
        """
        with self._lock:
            if not self._pending:
                return
            now = rospy.Time.now()
            # The clock may have moved back: no goal waits longer than its timeout.
            self._pending = [(each, min(end, now + each.get_goal().timeout)) for each, end in self._pending]
            due = [
                pair for pair in self._pending if pair[1] <= now or self._can_transform(pair[0].get_goal())
            ]
            self._pending = [pair for pair in self._pending if pair not in due]
        for handle, _ in due:
            self._complete(handle)

    def _on_goal(self, handle: Any) -> None:
        handle.set_accepted()
        goal = handle.get_goal()
        if goal.timeout.is_zero() or self._can_transform(goal):
            self._complete(handle)
            return
        with self._lock:
            self._pending.append((handle, rospy.Time.now() + goal.timeout))

    def _on_cancel(self, handle: Any) -> None:
        with self._lock:
            self._pending = [pair for pair in self._pending if pair[0] != handle]
        handle.set_canceled()

    def _can_transform(self, goal: Any) -> bool:
        if not goal.advanced:
            return bool(self.buffer.can_transform(goal.target_frame, goal.source_frame, goal.source_time))
        return bool(self.buffer.can_transform_full(*_full_arguments(goal)))

    def _complete(self, handle: Any) -> None:
        goal, result = handle.get_goal(), LookupTransformResult()
        try:
            if goal.advanced:
                result.transform = self.buffer.lookup_transform_full(*_full_arguments(goal))
            else:
                result.transform = self.buffer.lookup_transform(
                    goal.target_frame, goal.source_frame, goal.source_time
                )
        except TransformException as error:
            result.error.error = _CODES.get(type(error), TF2Error.TRANSFORM_ERROR)
            result.error.error_string = str(error)
        handle.set_succeeded(result)


def _full_arguments(goal: Any) -> tuple[str, Any, str, Any, str]:
    return (goal.target_frame, goal.target_time, goal.source_frame, goal.source_time, goal.fixed_frame)
