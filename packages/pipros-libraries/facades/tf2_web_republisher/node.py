"""`rosrun tf2_web_republisher tf2_web_republisher`: send changed transforms to clients.

Clients list frames in a goal for the action named after the node, and receive changed transforms as feedback.
The service `republish_tfs` publishes changed transforms on a topic `tf_repub_N` instead.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import TransformStamped

import actionlib
import rospy
import tf2_ros
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class, load_service_class
from pipros_libraries.transforms.change_filter import FramePair

ACTION: Any = load_message_class("tf2_web_republisher/TFSubscriptionAction")
FEEDBACK: Any = load_message_class("tf2_web_republisher/TFSubscriptionFeedback")
ARRAY: Any = load_message_class("tf2_web_republisher/TFArray")
SERVICE: Any = load_service_class("tf2_web_republisher/RepublishTFs")

DEFAULT_RATE_HZ = 10.0
HIGHEST_RATE_HZ = 100.0
MAX_FRAMES = 1000
"""Maximum number of frames per request; further frames are ignored."""
MAX_REQUESTS = 200
"""Maximum number of simultaneous goals and topics."""
DEFAULT_TIMEOUT_S = 10.0
"""Time without a subscriber after which a request ends, if the request does not set a timeout."""


class Watched:
    """The first `MAX_FRAMES` frames listed in one request (a goal or a service call)."""

    def __init__(self, request: Any, buffer: Any) -> None:
        """Store the frames and settings of `request`, which has the fields of a goal."""
        self._buffer = buffer
        self._pairs = [
            FramePair(
                source.lstrip("/"),
                request.target_frame.lstrip("/"),
                request.trans_thres,
                request.angular_thres,
            )
            for source in request.source_frames[:MAX_FRAMES]
        ]
        rate_hz = request.rate if request.rate > 0 else DEFAULT_RATE_HZ
        self.period_s = 1.0 / min(rate_hz, HIGHEST_RATE_HZ)

    def changed(self) -> list[TransformStamped]:
        """Return the transforms that have changed since this method last returned them."""
        return list(self._changed())

    def _changed(self) -> Iterator[TransformStamped]:
        for pair in self._pairs:
            try:
                found = self._buffer.lookup_transform(pair.target, pair.source, rospy.Time())
            except tf2_ros.TransformException:
                continue
            moved, turned = found.transform.translation, found.transform.rotation
            if pair.has_moved((moved.x, moved.y, moved.z, turned.x, turned.y, turned.z, turned.w)):
                yield found


class Republisher:
    """Server of the action and the service, with one thread per request."""

    def __init__(self) -> None:
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)
        self._numbers = itertools.count()
        self._slots = threading.BoundedSemaphore(MAX_REQUESTS)
        self._server = actionlib.ActionServer(
            rospy.get_name(), ACTION, self._on_goal, self._on_cancel, auto_start=False
        )
        self._server.start()
        self._service = rospy.Service("republish_tfs", SERVICE, self._republish)

    def _on_goal(self, goal: Any) -> None:
        if not self._slots.acquire(blocking=False):
            goal.set_rejected(text=f"the number of simultaneous requests must be <= {MAX_REQUESTS}")
            return
        goal.set_accepted()
        unused = Unused(self._server.feedback_pub, DEFAULT_TIMEOUT_S)

        def send(transforms: Sequence[Any]) -> None:
            goal.publish_feedback(FEEDBACK(list(transforms)))

        def is_over() -> bool:
            if goal.get_goal_status().status == GoalStatus.ACTIVE and unused.is_over():
                goal.set_aborted(text="no client subscribes to the feedback")
            return bool(goal.get_goal_status().status != GoalStatus.ACTIVE)

        self._start(Watched(goal.get_goal(), self._buffer), send, is_over)

    def _on_cancel(self, goal: Any) -> None:
        goal.set_canceled()

    def _republish(self, request: Any) -> Any:
        if not self._slots.acquire(blocking=False):
            raise rospy.ServiceException(f"the number of simultaneous requests must be <= {MAX_REQUESTS}")
        topic = f"tf_repub_{next(self._numbers)}"
        publisher = rospy.Publisher(topic, ARRAY, queue_size=10, latch=True)
        unused = Unused(publisher, request.timeout.to_sec() or DEFAULT_TIMEOUT_S)

        def is_over() -> bool:
            if unused.is_over():
                publisher.unregister()
                return True
            return False

        self._start(
            Watched(request, self._buffer),
            lambda transforms: publisher.publish(ARRAY(list(transforms))),
            is_over,
        )
        return SERVICE._response_class(rospy.resolve_name(topic))

    def _start(
        self, watched: Watched, send: Callable[[Sequence[Any]], object], is_over: Callable[[], bool]
    ) -> None:
        def run() -> None:
            try:
                while not rospy.is_shutdown() and not is_over():
                    if transforms := watched.changed():
                        send(transforms)
                    time.sleep(watched.period_s)
            finally:
                self._slots.release()

        threading.Thread(target=run, name="transforms of a client", daemon=True).start()


class Unused:
    """Timeout for a publisher without subscribers."""

    def __init__(self, publisher: Any, timeout_s: float) -> None:
        self._publisher = publisher
        self._timeout_s = timeout_s
        self._last_used_s = time.monotonic()

    def is_over(self) -> bool:
        """Return whether the timeout has elapsed since the start, or since a call last found a subscriber."""
        if self._publisher.get_num_connections():
            self._last_used_s = time.monotonic()
        return time.monotonic() - self._last_used_s >= self._timeout_s


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node("tf2_web_republisher")
    _republisher = Republisher()
    rospy.spin()
    return 0
