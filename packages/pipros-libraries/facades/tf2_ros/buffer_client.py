"""`BufferClient`, which looks up transforms in another node's buffer through an action."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_msgs.msg import GoalStatus
from tf2_msgs.msg import LookupTransformAction, LookupTransformGoal, TF2Error

import rospy
from actionlib import SimpleActionClient
from pipros.basics.lazy_names import star_names as _star_names
from tf2_py import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from tf2_ros.buffer_interface import BufferInterface

if TYPE_CHECKING:
    from geometry_msgs.msg import TransformStamped

    from pipros.msg.time import Duration, Time

_star_names(__name__, "actionlib tf2=tf2_py tf2_ros", hidden="ERRORS TF2Error")

ERRORS: dict[int, type[TransformException]] = {
    TF2Error.LOOKUP_ERROR: LookupException,
    TF2Error.CONNECTIVITY_ERROR: ConnectivityException,
    TF2Error.EXTRAPOLATION_ERROR: ExtrapolationException,
    TF2Error.INVALID_ARGUMENT_ERROR: InvalidArgumentException,
    TF2Error.TIMEOUT_ERROR: TimeoutException,
}
_PADDING = rospy.Duration.from_sec(2.0)
_NO_TIME = rospy.Duration(0.0)


class BufferClient(BufferInterface):
    """Client of the BufferServer `ns`. A node that uses it does not need to subscribe to /tf.

    Lookups block until the server replies, for at most `timeout` plus `timeout_padding`.

    Args:
        check_frequency: deprecated and ignored.
        timeout_padding: extra time to wait for the server beyond a lookup's timeout; 2 s by default.
    """

    def __init__(self, ns: str, check_frequency: Any = None, timeout_padding: Any = _PADDING) -> None:
        super().__init__()
        self.client = SimpleActionClient(ns, LookupTransformAction)
        self.timeout_padding = timeout_padding
        self._name = ns
        if check_frequency is not None:
            rospy.logwarn("BufferClient's check_frequency is deprecated and ignored: remove it.")

    def wait_for_server(self, timeout: Any = _NO_TIME) -> bool:
        """Wait until the server is connected. If `timeout` is zero, wait indefinitely.

        Return whether the server is connected.
        """
        return self.client.wait_for_server(timeout)

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Time, timeout: Duration = _NO_TIME
    ) -> TransformStamped:
        """Return the transform (TransformStamped) from the source frame to the target frame.

        Raises:
            TransformException: the server reported an error. The exception is the matching subclass.
            TimeoutException: the server did not reply in time, or did not complete the goal.
        """
        found: TransformStamped = self._send(
            LookupTransformGoal(
                target_frame=target_frame, source_frame=source_frame, source_time=time, timeout=timeout
            )
        )
        return found

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Time,
        source_frame: str,
        source_time: Time,
        fixed_frame: str,
        timeout: Duration = _NO_TIME,
    ) -> TransformStamped:
        """Like `lookup_transform`, but with the source at `source_time` and the target at `target_time`.

        `fixed_frame` must not move between these times.
        """
        found: TransformStamped = self._send(
            LookupTransformGoal(
                target_frame, source_frame, source_time, timeout, target_time, fixed_frame, True
            )
        )
        return found

    def can_transform(self, target_frame: str, source_frame: str, time: Any, timeout: Any = _NO_TIME) -> bool:
        """Return whether `lookup_transform` succeeds."""
        try:
            self.lookup_transform(target_frame, source_frame, time, timeout)
        except TransformException:
            return False
        return True

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = _NO_TIME,
    ) -> bool:
        """Return whether `lookup_transform_full` succeeds."""
        try:
            self.lookup_transform_full(
                target_frame, target_time, source_frame, source_time, fixed_frame, timeout
            )
        except TransformException:
            return False
        return True

    def _send(self, goal: LookupTransformGoal) -> Any:
        self.client.send_goal(goal)
        if not self.client.wait_for_result(goal.timeout + self.timeout_padding):
            raise TimeoutException(f"BufferServer [{self._name}] did not reply in time: is it running?")
        state = self.client.get_state()
        if state != GoalStatus.SUCCEEDED:
            name = GoalStatus.to_string(state)  # type: ignore[attr-defined]
            raise TimeoutException(f"goal to BufferServer [{self._name}] ended with status {name} ({state})")
        result = self.client.get_result()
        error = result.error
        if error.error == error.NO_ERROR:
            return result.transform
        raise ERRORS.get(error.error, TransformException)(error.error_string)
