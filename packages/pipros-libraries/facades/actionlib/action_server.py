"""`ActionServer`, which receives goals and cancellations, and publishes status, feedback and results."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from threading import RLock
from typing import Any

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

import rospy
from actionlib.action_types import ActionTypes
from actionlib.exceptions import ActionException as ActionException
from actionlib.goal_id_generator import GoalIDGenerator
from actionlib.handle_tracker_deleter import HandleTrackerDeleter
from actionlib.server_goal_handle import ServerGoalHandle
from actionlib.status_tracker import StatusTracker
from pipros.basics.intervals import ClockWatch
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.limits import limit_text, process_limits
from pipros.basics.names import NAME_CHARACTERS
from pipros_libraries.actions.feedback_first import FeedbackFirst
from pipros_libraries.actions.goal_table import append_goal, meant_by

_star_names(__name__, "threading")

_SHORTEST_PERIOD_S = 0.001
"""Minimum interval between two status messages.

Without it, a timer with a frequency of 1e12 would never sleep.
"""


def nop_cb(goal_handle: Any) -> None:
    """Do nothing."""


class ActionServer:
    """Server for the action in the namespace `ns`. Accepts concurrent goals, up to the limit `goals`.

    Callbacks run one at a time, without holding the server's lock, so callbacks and other threads may use the
    goal handles at the same time.

    Attributes:
        status_list: the goals reported on the status topic, in order of arrival. Programs may modify the list
            while holding `lock`. If they remove a goal, the server forgets the goal, and clients report it
            as lost.

    Args:
        goal_cb: called with the ServerGoalHandle of each new goal.
        cancel_cb: called with the ServerGoalHandle of each goal whose cancellation was requested.
        auto_start: whether to start immediately. True is deprecated because callbacks may then run before the
            constructor returns. Pass False and call `start`.
    """

    def __init__(
        self,
        ns: str,
        ActionSpec: Any,
        goal_cb: Callable[[Any], object],
        cancel_cb: Callable[[Any], object] = nop_cb,
        auto_start: bool = True,
    ) -> None:
        self.ns = ns
        types = ActionTypes(ActionSpec)
        self.ActionSpec = ActionSpec
        self.ActionGoal, self.ActionResult, self.ActionFeedback = types.goal, types.result, types.feedback
        self.ActionResultType = types.result_content
        self.goal_sub: Any = None
        self.cancel_sub: Any = None
        self.status_pub: Any = None
        self.result_pub: Any = None
        self.feedback_pub: Any = None
        self.lock = RLock()
        self._callback_lock = RLock()
        self.status_timer: Any = None
        self.status_list: list[StatusTracker] = []
        self._has_refused = False
        self._feedback_first = FeedbackFirst()
        self.last_cancel = rospy.Time()
        self._watch, self._epoch = ClockWatch(), 0
        self.status_list_timeout = rospy.Duration()
        self.id_generator = GoalIDGenerator()
        if not callable(goal_cb):
            raise AssertionError(f"goal_cb must be callable with a goal handle, got {goal_cb!r}")
        self.goal_callback = goal_cb
        self.cancel_callback = cancel_cb
        self.auto_start = auto_start
        self.started = False
        if auto_start:
            rospy.logwarn(
                "Action server [%s] uses auto_start: goals may arrive before the constructor has returned. "
                "Pass auto_start=False and call start().",
                ns,
            )
            self.start()

    def register_goal_callback(self, cb: Callable[[Any], object]) -> None:
        """Set the function to call with each new goal."""
        self.goal_callback = cb

    def register_cancel_callback(self, cancel_cb: Callable[[Any], object]) -> None:
        """Set the function to call with each goal whose cancellation was requested."""
        self.cancel_callback = cancel_cb

    def start(self) -> None:
        """Start accepting goals."""
        with self.lock:
            self.initialize()
            self.started = True
            self.publish_status()

    def stop(self) -> None:
        """Stop accepting goals, and unregister from all topics."""
        with self.lock:
            self.started = False
            parts = (self.goal_sub, self.cancel_sub, self.status_pub, self.feedback_pub, self.result_pub)
            if self.status_timer is not None:
                self.status_timer.shutdown()
        for part in parts:
            if part is not None:
                part.unregister()

    def initialize(self) -> None:
        """Advertise and subscribe to the topics. Called by `start`."""
        name: str = rospy.remap_name(self.ns) + "/"
        size = rospy.get_param("actionlib_server_pub_queue_size", 50)
        self.pub_queue_size = 50 if size < 0 else size
        more: dict[str, Any] = {"queue_size": self.pub_queue_size}
        self.status_pub = rospy.Publisher(f"{name}status", GoalStatusArray, latch=True, **more)
        self.result_pub = rospy.Publisher(f"{name}result", self.ActionResult, **more)
        self.feedback_pub = rospy.Publisher(f"{name}feedback", self.ActionFeedback, **more)
        size = rospy.get_param("actionlib_server_sub_queue_size", -1)
        self.sub_queue_size = None if size < 0 else size
        more = {"queue_size": self.sub_queue_size}
        self.goal_sub = rospy.Subscriber(f"{name}goal", self.ActionGoal, self.internal_goal_callback, **more)
        self.cancel_sub = rospy.Subscriber(f"{name}cancel", GoalID, self.internal_cancel_callback, **more)
        self.status_frequency = self._status_frequency(name)
        self.status_list_timeout = rospy.Duration(rospy.get_param(f"{name}status_list_timeout", 5.0))
        if self.status_frequency > 0.0:
            period = rospy.Duration(max(1.0 / self.status_frequency, _SHORTEST_PERIOD_S))
            self.status_timer = rospy.Timer(period, self.publish_status_async, reset=True)

    def _status_frequency(self, name: str) -> float:
        if rospy.has_param(f"{name}status_frequency"):
            rospy.logwarn("Parameter %sstatus_frequency is deprecated: set actionlib_status_frequency.", name)
            return float(rospy.get_param(f"{name}status_frequency", 5.0))
        found = rospy.search_param("actionlib_status_frequency")
        return 5.0 if found is None else float(rospy.get_param(found, 5.0))

    def publish_result(self, status: Any, result: Any) -> None:
        """Publish the result of a goal, and the status of all goals."""
        with self.lock:
            message = self.ActionResult(status=deepcopy(status), result=result)
            self._feedback_first.wait()
            message.header.stamp = rospy.Time.now()
            if not rospy.is_shutdown():
                self.result_pub.publish(message)
            self.publish_status()

    def publish_feedback(self, status: Any, feedback: Any) -> None:
        """Publish feedback for a goal."""
        with self.lock:
            message = self.ActionFeedback(status=deepcopy(status), feedback=feedback)
            message.header.stamp = rospy.Time.now()
            if not rospy.is_shutdown():
                self.feedback_pub.publish(message)
            self._feedback_first.note_feedback()

    def internal_cancel_callback(self, goal_id: Any) -> None:
        """Handle a request to cancel one goal, all goals up to a timestamp, both, or all goals."""
        with self._callback_lock:
            for handle in self._cancelled(goal_id):
                self.cancel_callback(handle)

    def _cancelled(self, goal_id: Any) -> list[ServerGoalHandle]:
        """Record a cancellation request. Return handles for the goals whose status changed."""
        cancelled = []
        with self.lock:
            if not self.started:
                return []
            self._follow_clock(rospy.Time.now())
            known = self._find(goal_id.id)
            stamp = goal_id.stamp.to_nsec()
            for tracker in meant_by(self.status_list, known, goal_id.id, stamp, _stamp_of):
                if tracker.handle_tracker is None:
                    tracker.handle_tracker = HandleTrackerDeleter(self, tracker)
                    tracker.handle_destruction_time = rospy.Time.now()
                handle = ServerGoalHandle(tracker, self, tracker.handle_tracker)
                if handle.set_cancel_requested():
                    cancelled.append(handle)
            if goal_id.id and known is None:
                self._expect_cancelled(goal_id)
            self.last_cancel = max(self.last_cancel, goal_id.stamp)
        return cancelled

    def _expect_cancelled(self, goal_id: Any) -> None:
        """Record the cancellation of a goal that may still arrive."""
        tracker = StatusTracker(goal_id, GoalStatus.RECALLING)
        tracker.handle_destruction_time = rospy.Time.now()
        if not self._add(tracker):
            self._warn_of_refusal()

    def internal_goal_callback(self, goal: Any) -> None:
        """Handle a goal message."""
        with self._callback_lock:
            handle = self._accept_new(goal)
            if handle is not None:
                self.goal_callback(handle)

    def _accept_new(self, goal: Any) -> ServerGoalHandle | None:
        """Return a handle for a new goal.

        Return None if the goal is a duplicate, was cancelled before it arrived or is rejected, or if the
        server is not started.
        """
        with self.lock:
            if not self.started:
                return None
            self._follow_clock(rospy.Time.now())
            known = self._find(goal.goal_id.id)
            if known is not None:
                self._handle_known(known)
                return None
            # Only a timestamp set by the client can be earlier than a cancellation; a missing timestamp
            # is set to the time of arrival.
            is_late = not goal.goal_id.stamp.is_zero() and goal.goal_id.stamp <= self.last_cancel
            tracker = StatusTracker(None, None, goal)
            if not self._add(tracker):
                self._reject(tracker)
                return None
            tracker.handle_tracker = HandleTrackerDeleter(self, tracker)
            handle = ServerGoalHandle(tracker, self, tracker.handle_tracker)
            if is_late:
                handle.set_canceled(
                    None, "This goal was cancelled by a request for all goals up to a later stamp."
                )
                return None
            return handle

    def _find(self, goal_id: str) -> StatusTracker | None:
        return next((each for each in self.status_list if each.status.goal_id.id == goal_id), None)

    def _add(self, tracker: StatusTracker) -> bool:
        """Add a goal to the list. If the list is full, replace the oldest ended goal.

        Return False if the list is full and no goal has ended, or if the goal's ID is too long.
        """
        limits = process_limits()
        tracker.epoch = self._epoch
        if len(tracker.status.goal_id.id) > NAME_CHARACTERS:
            return False
        return append_goal(self.status_list, tracker, limits.goals, _has_ended)

    def _handle_known(self, tracker: StatusTracker) -> None:
        """Handle a goal that has already arrived, or that was cancelled before it arrived."""
        if tracker.status.status == GoalStatus.RECALLING:
            tracker.status.status = GoalStatus.RECALLED
            self.publish_result(tracker.status, self.ActionResultType())
        if tracker.handle_tracker is None:
            tracker.handle_destruction_time = rospy.Time.now()

    def _reject(self, tracker: StatusTracker) -> None:
        """Reject a goal because the server has too many goals or the goal ID is too long."""
        self._warn_of_refusal()
        tracker.status.status = GoalStatus.REJECTED
        tracker.status.text = "this action server has too many goals, or the goal ID is too long"
        message = self.ActionResult(status=tracker.status, result=self.ActionResultType())
        message.header.stamp = rospy.Time.now()
        if not rospy.is_shutdown():
            self.result_pub.publish(message)

    def _warn_of_refusal(self) -> None:
        if not self._has_refused:
            self._has_refused = True
            rospy.logwarn(
                "The action server %s refuses goals, because there are too many or an ID is too long; %s",
                self.ns,
                limit_text("goals", process_limits().goals),
            )

    def publish_status_async(self, event: Any) -> None:  # noqa: ARG002 # passed by the timer
        """Publish the status of all goals if the server is running. Called by a timer."""
        with self.lock:
            if self.started:
                self.publish_status()

    def publish_status(self) -> None:
        """Publish the status of all goals. Ended goals remain listed for `status_list_timeout`."""
        with self.lock:
            now = rospy.Time.now()
            self._follow_clock(now)
            self.status_list[:] = [
                tracker
                for tracker in self.status_list
                if not _has_ended(tracker)
                or tracker.handle_destruction_time
                <= now
                <= tracker.handle_destruction_time + self.status_list_timeout
            ]
            message = GoalStatusArray(status_list=[tracker.status for tracker in self.status_list])
            message.header.stamp = now
            if not rospy.is_shutdown():
                self.status_pub.publish(message)

    def _follow_clock(self, now: Any) -> None:
        """If the clock has moved back, stamps from before no longer make new goals too late."""
        if self._watch.has_gone_back(now.to_nsec()):
            self._epoch, self.last_cancel = self._epoch + 1, rospy.Time()


def _has_ended(tracker: StatusTracker) -> bool:
    return not tracker.handle_destruction_time.is_zero()


def _stamp_of(tracker: StatusTracker) -> int:
    return int(tracker.status.goal_id.stamp.to_nsec())
