"""`SimpleActionClient`, which tracks one goal at a time."""

from __future__ import annotations

from collections.abc import Callable
from threading import Condition, RLock
from typing import Any

from actionlib_msgs.msg import GoalStatus

import rospy
from actionlib.action_client import ActionClient, ClientGoalHandle, CommState, get_name_of_constant
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "threading")

_SLICE_S = 0.1
"""Maximum interval between checks for Ctrl-C, shutdown and simulated time while waiting."""


class SimpleGoalState:
    """States of the current goal."""

    PENDING = 0
    ACTIVE = 1
    DONE = 2

    to_string = classmethod(get_name_of_constant)


class SimpleActionClient:
    """Client of the action server `ns`. Tracks one goal at a time.

    Transition callbacks run one at a time for each goal, in a thread of the node or in the thread that
    cancels the goal. A new goal replaces the tracked goal without cancelling it.
    """

    def __init__(self, ns: str, ActionSpec: Any) -> None:
        self.action_client = ActionClient(ns, ActionSpec)
        self.simple_state = SimpleGoalState.DONE
        self.gh: ClientGoalHandle | None = None
        self.done_condition = Condition(RLock())
        self.done_cb: Callable[..., object] | None = None
        self.active_cb: Callable[..., object] | None = None
        self.feedback_cb: Callable[..., object] | None = None
        self._number = 0

    def wait_for_server(self, timeout: Any = rospy.Duration()) -> bool:  # noqa: B008
        """Wait until a server is connected on all topics. If `timeout` is zero, wait indefinitely.

        Return False if the timeout expires or the node is shut down first.
        """
        return self.action_client.wait_for_server(timeout)

    def send_goal(
        self, goal: Any, done_cb: Any = None, active_cb: Any = None, feedback_cb: Any = None
    ) -> None:
        """Send a goal and track it instead of the previous goal. Does not wait for the server.

        Args:
            done_cb: called with the final status and the result.
            active_cb: called without arguments when the goal becomes active.
            feedback_cb: called with each feedback message.
        """
        with self.done_condition:
            self._number = number = self._number + 1
            self.gh = None
            self.done_cb, self.active_cb, self.feedback_cb = done_cb, active_cb, feedback_cb
            self.simple_state = SimpleGoalState.PENDING
        # Status updates may arrive before `gh` is set; the number identifies their goal.
        handle = self.action_client.send_goal(
            goal,
            lambda gh: self._handle_transition(gh, number),
            lambda gh, feedback: self._handle_feedback(gh, feedback, number),
        )
        with self.done_condition:
            if self._number == number:
                self.gh = handle

    def send_goal_and_wait(
        self,
        goal: Any,
        execute_timeout: Any = rospy.Duration(),  # noqa: B008
        preempt_timeout: Any = rospy.Duration(),  # noqa: B008
    ) -> int:
        """Send a goal, wait until it has ended, and return its status.

        Args:
            execute_timeout: time to wait before cancelling the goal; no limit unless it is positive.
            preempt_timeout: time to wait after the cancellation; no limit unless it is positive.
        """
        self.send_goal(goal)
        if not self.wait_for_result(execute_timeout):
            self.cancel_goal()
            self.wait_for_result(preempt_timeout)
        return self.get_state()

    def wait_for_result(self, timeout: Any = rospy.Duration()) -> bool:  # noqa: B008
        """Wait until the goal has ended. If `timeout` is zero or negative, wait indefinitely.

        Return whether the goal has ended. If there is no goal, log an error and return False immediately.
        """
        if self.gh is None:
            rospy.logerr("wait_for_result was called without a goal")
            return False
        end = rospy.get_rostime() + timeout
        is_endless = timeout <= rospy.Duration()
        with self.done_condition:
            while self.simple_state != SimpleGoalState.DONE and not rospy.is_shutdown():
                left = _SLICE_S
                if not is_endless:
                    now = rospy.get_rostime()
                    end = min(end, now + timeout)  # the clock may have moved back
                    left = (end - now).to_sec()
                    if left <= 0.0:
                        break
                self.done_condition.wait(min(left, _SLICE_S))
            return self.simple_state == SimpleGoalState.DONE

    def get_result(self) -> Any:
        """Return the result of the goal, or None before `get_state` returns a final status."""
        if self.gh is None:
            rospy.logerr("get_result was called without a goal")
            return None
        return self.gh.get_result() if self.gh.get_comm_state() == CommState.DONE else None

    def get_state(self) -> int:
        """Return the status of the goal: PENDING, ACTIVE or its final status.

        Statuses and results arrive on separate topics. A status is final only once the result has arrived, as
        in the C++ client. Return LOST if there is no goal.
        """
        if self.gh is None:
            return GoalStatus.LOST
        if self.gh.get_comm_state() == CommState.DONE:
            return self.gh.get_goal_status()
        return GoalStatus.ACTIVE if self.simple_state == SimpleGoalState.ACTIVE else GoalStatus.PENDING

    def get_goal_status_text(self) -> str:
        """Return the text that the server sent with the status."""
        if self.gh is None:
            rospy.logerr("get_goal_status_text was called without a goal")
            return "ERROR: Called get_goal_status_text when no goal is running"
        return self.gh.get_goal_status_text()

    def cancel_all_goals(self) -> None:
        """Request cancellation of all goals from all clients."""
        self.action_client.cancel_all_goals()

    def cancel_goals_at_and_before_time(self, time: Any) -> None:
        """Request cancellation of all goals, from all clients, with a timestamp at or before `time`."""
        self.action_client.cancel_goals_at_and_before_time(time)

    def cancel_goal(self) -> None:
        """Request cancellation of the goal."""
        handle = self.gh
        if handle is not None:
            handle.cancel()

    def stop_tracking_goal(self) -> None:
        """Stop tracking the goal without cancelling it."""
        with self.done_condition:
            self._number += 1
            self.gh = None

    def _handle_transition(self, gh: ClientGoalHandle, number: int) -> None:
        state = gh.get_comm_state()
        with self.done_condition:
            if number != self._number or self.simple_state == SimpleGoalState.DONE:
                return
            self.gh = gh
            active_cb, done_cb = self.active_cb, self.done_cb
            is_started = state in (CommState.ACTIVE, CommState.PREEMPTING)
            if is_started and self.simple_state == SimpleGoalState.PENDING:
                self.simple_state = SimpleGoalState.ACTIVE
            else:
                active_cb = None
        if active_cb:
            active_cb()
        if state == CommState.DONE:
            self._finish(gh, number, done_cb)

    def _finish(self, gh: ClientGoalHandle, number: int, done_cb: Callable[..., object] | None) -> None:
        try:
            if done_cb:
                done_cb(gh.get_goal_status(), gh.get_result())
        finally:  # wake waiting threads even if the callback raises
            with self.done_condition:
                if number == self._number:
                    self.simple_state = SimpleGoalState.DONE
                    self.done_condition.notify_all()

    def _handle_feedback(self, gh: ClientGoalHandle, feedback: Any, number: int) -> None:  # noqa: ARG002
        callback = self.feedback_cb
        if number == self._number and callback:
            callback(feedback)
