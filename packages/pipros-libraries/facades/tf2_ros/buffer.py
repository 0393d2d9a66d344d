"""`Buffer`, a transform buffer whose lookups can wait."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from tf2_msgs.srv import FrameGraph, FrameGraphResponse

import rospy
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.transforms.messages import in_ns
from tf2_py import BufferCore
from tf2_ros.buffer_interface import BufferInterface

if TYPE_CHECKING:
    from geometry_msgs.msg import TransformStamped

    from pipros.msg.time import Duration, Time

_star_names(__name__, "rosgraph tf2=tf2_py tf2_ros")

DEFAULT_CAN_TRANSFORM_POLLING_SCALE = 0.01
_NO_TIME = rospy.Duration(0.0)


class Buffer(BufferCore, BufferInterface):
    """Buffer for the transforms of the last `cache_time`. Lookups can wait for missing transforms.

    All methods may be called from any thread. Waiting lookups are woken by new transforms; they do not poll.

    Args:
        cache_time: a `rospy.Duration`; None for 10 s.
        debug: whether to offer the service `~tf2_frames`, which returns all frames as YAML.
    """

    def __init__(self, cache_time: Any = None, debug: bool = True) -> None:
        BufferCore.__init__(self, cache_time)
        BufferInterface.__init__(self)
        self.CAN_TRANSFORM_POLLING_SCALE = DEFAULT_CAN_TRANSFORM_POLLING_SCALE
        if debug:
            self._advertise_frames()

    def _advertise_frames(self) -> None:
        import rosgraph

        try:
            rosgraph.Master(rospy.get_name()).lookupService("~tf2_frames")
        except (rosgraph.MasterError, rosgraph.MasterFailure):
            self.frame_server = rospy.Service("~tf2_frames", FrameGraph, self._frames_as_response)

    def _frames_as_response(self, _: Any) -> Any:
        return FrameGraphResponse(self.all_frames_as_yaml())

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Time, timeout: Duration = _NO_TIME
    ) -> TransformStamped:
        """Return the transform (TransformStamped) from the source frame to the target frame.

        Args:
            time: lookup time; zero for the latest common time.
            timeout: maximum time to wait for the transform; zero does not wait.

        Raises:
            LookupException, ConnectivityException, ExtrapolationException, InvalidArgumentException.
            ROSInterruptException: the node was shut down while waiting.
            TypeError: `time` or `timeout` is a number.
        """
        if in_ns(timeout):
            self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

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
        arguments = (target_frame, target_time, source_frame, source_time, fixed_frame)
        if in_ns(timeout):
            self.can_transform_full(*arguments, timeout)
        return self.lookup_transform_full_core(*arguments)

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Time,
        timeout: Duration = _NO_TIME,
        return_debug_tuple: bool = False,
    ) -> Any:
        """Wait up to `timeout`. Return 1 if `lookup_transform` would succeed, otherwise 0.

        If `return_debug_tuple` is true, return a tuple of this number and the reason for the failure.
        """
        result = self._wait(lambda: self.can_transform_core(target_frame, source_frame, time), timeout)
        return result if return_debug_tuple else result[0]

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Time,
        source_frame: str,
        source_time: Time,
        fixed_frame: str,
        timeout: Duration = _NO_TIME,
        return_debug_tuple: bool = False,
    ) -> Any:
        """Like `can_transform`, for `lookup_transform_full`."""
        arguments = (target_frame, target_time, source_frame, source_time, fixed_frame)
        result = self._wait(lambda: self.can_transform_full_core(*arguments), timeout)
        return result if return_debug_tuple else result[0]

    def _wait(self, ask: Callable[[], tuple[int, str]], timeout: Any) -> tuple[int, str]:
        """Call `ask` now and after each new transform, until it succeeds, time runs out or the node ends.

        Return the last result.
        """
        result, limit = ask(), in_ns(timeout)
        if result[0] or not limit:
            return result
        return self._buffer.waiter.wait(ask, limit, rospy.rostime.clock, rospy.is_shutdown)
