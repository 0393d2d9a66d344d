"""`Buffer`: the transforms that a node knows of."""

from __future__ import annotations

from collections.abc import Callable
from threading import Condition
from typing import Any

from tf2_msgs.srv import FrameGraph, FrameGraphResponse

import rospy
from pipros.lazy_names import star_names as _star_names
from tf2_py import BufferCore
from tf2_ros.buffer_interface import BufferInterface

_star_names(__name__, "rosgraph tf2=tf2_py tf2_ros")

DEFAULT_CAN_TRANSFORM_POLLING_SCALE = 0.01

_SLICE_S = 0.1
"""How long a wait lasts before it looks for Ctrl-C, a shutdown, and a simulated clock."""


class Buffer(BufferCore, BufferInterface):
    """The transforms of the last `cache_time`, and questions that wait for transforms to come.

    Args:
        cache_time: a `rospy.Duration`; 10 s for None.
        debug: offer the service `~tf2_frames`, which tells all frames.
    """

    def __init__(self, cache_time: Any = None, debug: bool = True) -> None:
        BufferCore.__init__(self, cache_time)
        BufferInterface.__init__(self)
        self._news = Condition()
        self._waiting = 0
        self.CAN_TRANSFORM_POLLING_SCALE = DEFAULT_CAN_TRANSFORM_POLLING_SCALE
        if debug:
            self._offer_frames()

    def _offer_frames(self) -> None:
        import rosgraph

        try:
            rosgraph.Master(rospy.get_name()).lookupService("~tf2_frames")
        except (rosgraph.MasterError, rosgraph.MasterFailure):
            self.frame_server = rospy.Service("~tf2_frames", FrameGraph, self._tell_frames)

    def _tell_frames(self, _: Any) -> Any:
        return FrameGraphResponse(self.all_frames_as_yaml())

    def _insert(self, transform: Any, authority: str, is_static: bool) -> None:
        super()._insert(transform, authority, is_static)
        if self._waiting:
            with self._news:
                self._news.notify_all()

    def lookup_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008 # as its documentation shows it
    ) -> Any:
        """The transform (TransformStamped) that brings data of the source into the target.

        Args:
            time: when; zero for the newest time at which it is known.
            timeout: how long to wait for it.

        Raises:
            LookupException, ConnectivityException, ExtrapolationException, InvalidArgumentException.
            ROSInterruptException: the node ended meanwhile.
        """
        if timeout.secs or timeout.nsecs:
            self.can_transform(target_frame, source_frame, time, timeout)
        return self.lookup_transform_core(target_frame, source_frame, time)

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008
    ) -> Any:
        """As `lookup_transform`, of the source at one time in the target at another.

        `fixed_frame` is one that does not move between these times.
        """
        asked = (target_frame, target_time, source_frame, source_time, fixed_frame)
        if timeout.secs or timeout.nsecs:
            self.can_transform_full(*asked, timeout)
        return self.lookup_transform_full_core(*asked)

    def can_transform(
        self,
        target_frame: str,
        source_frame: str,
        time: Any,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008
        return_debug_tuple: bool = False,
    ) -> Any:
        """Whether `lookup_transform` would succeed.

        1 or 0, with `return_debug_tuple` and why it would not.
        """
        answer = self._wait(lambda: self.can_transform_core(target_frame, source_frame, time), timeout)
        return answer if return_debug_tuple else answer[0]

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Any,
        source_frame: str,
        source_time: Any,
        fixed_frame: str,
        timeout: Any = rospy.Duration(0.0),  # noqa: B008
        return_debug_tuple: bool = False,
    ) -> Any:
        """Whether `lookup_transform_full` would succeed: 1 or 0, with `return_debug_tuple` and why not."""
        asked = (target_frame, target_time, source_frame, source_time, fixed_frame)
        answer = self._wait(lambda: self.can_transform_full_core(*asked), timeout)
        return answer if return_debug_tuple else answer[0]

    def _wait(self, ask: Callable[[], tuple[int, str]], timeout: Any) -> tuple[int, str]:
        """The answer, asked for again with each transform that comes until it is yes or time is up.

        A clock that goes back by more than 3 s ends the wait: a bag began again.
        """
        answer = ask()
        if answer[0] or not (timeout.secs or timeout.nsecs):
            return answer
        start = rospy.Time.now()
        end = start + timeout
        with self._news:
            self._waiting += 1
            try:
                while not (answer := ask())[0]:
                    now = rospy.Time.now()
                    if now >= end or now + rospy.Duration(3) < start:
                        break
                    if rospy.is_shutdown():
                        raise rospy.ROSInterruptException("the node ended while it waited for a transform")
                    left = (end - now).to_sec() if rospy.rostime.is_wallclock() else _SLICE_S
                    self._news.wait(min(left, _SLICE_S))
            finally:
                self._waiting -= 1
        return answer
