"""`ActionServer`: takes goals and cancel requests, sends statuses, feedback and results."""

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
from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "threading")


def nop_cb(goal_handle: Any) -> None:
    """Does nothing."""


class ActionServer:
    """Serves an action below the name `ns`.

    Callbacks come one at a time, and without the server's lock: they and other threads may use goals at will.

    Args:
        goal_cb: called with a ServerGoalHandle for each new goal.
        cancel_cb: called with a ServerGoalHandle that a client asked to cancel.
        auto_start: start at once. Callbacks may then come before the constructor returns, so better call
        `start`.
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
        self._one_callback = RLock()
        self.status_timer: Any = None
        self.status_list: list[StatusTracker] = []
        self.last_cancel = rospy.Time()
        self.status_list_timeout = rospy.Duration()
        self.id_generator = GoalIDGenerator()
        if not callable(goal_cb):
            raise AssertionError(f"goal_cb must be a function that takes a goal handle, got {goal_cb!r}")
        self.goal_callback = goal_cb
        self.cancel_callback = cancel_cb
        self.auto_start = auto_start
        self.started = False
        if auto_start:
            rospy.logwarn(
                "The action server %s starts by itself: goals may come before its constructor has returned. "
                "Better pass auto_start=False and call start().",
                ns,
            )
            self.start()

    def register_goal_callback(self, cb: Callable[[Any], object]) -> None:
        """Calls another function with new goals from now on."""
        self.goal_callback = cb

    def register_cancel_callback(self, cancel_cb: Callable[[Any], object]) -> None:
        """Calls another function with goals to cancel from now on."""
        self.cancel_callback = cancel_cb

    def start(self) -> None:
        """Takes goals from now on."""
        with self.lock:
            self.initialize()
            self.started = True
            self.publish_status()

    def stop(self) -> None:
        """Takes no goals any more, and leaves all topics."""
        with self.lock:
            self.started = False
            parts = (self.goal_sub, self.cancel_sub, self.status_pub, self.feedback_pub, self.result_pub)
            if self.status_timer is not None:
                self.status_timer.shutdown()
        for part in parts:
            if part is not None:
                part.unregister()

    def initialize(self) -> None:
        """Makes the topics; `start` calls it."""
        name = rospy.remap_name(self.ns)
        size = rospy.get_param("actionlib_server_pub_queue_size", 50)
        self.pub_queue_size = 50 if size < 0 else size
        more: dict[str, Any] = {"queue_size": self.pub_queue_size}
        self.status_pub = rospy.Publisher(f"{name}/status", GoalStatusArray, latch=True, **more)
        self.result_pub = rospy.Publisher(f"{name}/result", self.ActionResult, **more)
        self.feedback_pub = rospy.Publisher(f"{name}/feedback", self.ActionFeedback, **more)
        size = rospy.get_param("actionlib_server_sub_queue_size", -1)
        self.sub_queue_size = None if size < 0 else size
        more = {"queue_size": self.sub_queue_size}
        self.goal_sub = rospy.Subscriber(f"{name}/goal", self.ActionGoal, self.internal_goal_callback, **more)
        self.cancel_sub = rospy.Subscriber(f"{name}/cancel", GoalID, self.internal_cancel_callback, **more)
        self.status_frequency = self._status_frequency(name)
        self.status_list_timeout = rospy.Duration(rospy.get_param(f"{name}/status_list_timeout", 5.0))
        if self.status_frequency > 0.0:
            period = rospy.Duration(1.0 / self.status_frequency)
            self.status_timer = rospy.Timer(period, self.publish_status_async, reset=True)

    def _status_frequency(self, name: str) -> float:
        if rospy.has_param(f"{name}/status_frequency"):
            rospy.logwarn(
                "The parameter %s/status_frequency is out of use: set actionlib_status_frequency.", name
            )
            return float(rospy.get_param(f"{name}/status_frequency", 5.0))
        found = rospy.search_param("actionlib_status_frequency")
        return 5.0 if found is None else float(rospy.get_param(found, 5.0))

    def publish_result(self, status: Any, result: Any) -> None:
        """Sends the result of a goal, and all statuses."""
        with self.lock:
            message = self.ActionResult(status=deepcopy(status), result=result)
            message.header.stamp = rospy.Time.now()
            if not rospy.is_shutdown():
                self.result_pub.publish(message)
            self.publish_status()

    def publish_feedback(self, status: Any, feedback: Any) -> None:
        """Sends feedback for a goal."""
        with self.lock:
            message = self.ActionFeedback(status=deepcopy(status), feedback=feedback)
            message.header.stamp = rospy.Time.now()
            if not rospy.is_shutdown():
                self.feedback_pub.publish(message)

    def internal_cancel_callback(self, goal_id: Any) -> None:
        """Called with each request to cancel: one goal, all until a time, or all."""
        with self._one_callback:
            for handle in self._cancelled(goal_id):
                self.cancel_callback(handle)

    def _cancelled(self, goal_id: Any) -> list[ServerGoalHandle]:
        """The goals that this request cancels, and that were not cancelled before."""
        cancelled = []
        with self.lock:
            if not self.started:
                return []
            stamp, wanted = goal_id.stamp, goal_id.id
            is_found = False
            for tracker in self.status_list[:]:
                known = tracker.status.goal_id
                if wanted == known.id:
                    is_found = True
                elif not (stamp.is_zero() and not wanted) and not (
                    not stamp.is_zero() and known.stamp <= stamp
                ):
                    continue
                if tracker.handle_tracker is None:
                    tracker.handle_tracker = HandleTrackerDeleter(self, tracker)
                    tracker.handle_destruction_time = rospy.Time.now()
                handle = ServerGoalHandle(tracker, self, tracker.handle_tracker)
                if handle.set_cancel_requested():
                    cancelled.append(handle)
            if wanted and not is_found:  # the goal may still come
                tracker = StatusTracker(goal_id, GoalStatus.RECALLING)
                tracker.handle_destruction_time = rospy.Time.now()
                self.status_list.append(tracker)
            if stamp > self.last_cancel:
                self.last_cancel = stamp
        return cancelled

    def internal_goal_callback(self, goal: Any) -> None:
        """Called with each goal that comes."""
        with self._one_callback:
            handle = self._accept_new(goal)
            if handle is not None:
                self.goal_callback(handle)

    def _accept_new(self, goal: Any) -> ServerGoalHandle | None:
        """A handle for a goal that is new and not cancelled already."""
        with self.lock:
            if not self.started:
                return None
            for tracker in self.status_list:
                if goal.goal_id.id == tracker.status.goal_id.id:
                    if tracker.status.status == GoalStatus.RECALLING:
                        tracker.status.status = GoalStatus.RECALLED
                        self.publish_result(tracker.status, self.ActionResultType())
                    if tracker.handle_tracker is None:
                        tracker.handle_destruction_time = rospy.Time.now()
                    return None
            # By the stamp that the client gave: one that the server gives is never before a request to
            # cancel.
            is_late = not goal.goal_id.stamp.is_zero() and goal.goal_id.stamp <= self.last_cancel
            tracker = StatusTracker(None, None, goal)
            self.status_list.append(tracker)
            tracker.handle_tracker = HandleTrackerDeleter(self, tracker)
            handle = ServerGoalHandle(tracker, self, tracker.handle_tracker)
            if is_late:
                handle.set_canceled(
                    None, "This goal was cancelled by a request for all goals up to a time after its own."
                )
                return None
            return handle

    def publish_status_async(self, event: Any) -> None:  # noqa: ARG002 # of the timer
        """Called by a timer."""
        with self.lock:
            if self.started:
                self.publish_status()

    def publish_status(self) -> None:
        """Sends the status of all goals. Goals that have ended stay in it for `status_list_timeout`."""
        with self.lock:
            now = rospy.Time.now()
            kept = []
            for tracker in self.status_list:
                ended = tracker.handle_destruction_time
                if ended.is_zero() or ended + self.status_list_timeout >= now:
                    kept.append(tracker)
            self.status_list = kept
            message = GoalStatusArray(status_list=[tracker.status for tracker in kept])
            message.header.stamp = now
            if not rospy.is_shutdown():
                self.status_pub.publish(message)
