"""`SimpleActionServer`: one goal at a time; a new goal asks the one before to end."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from threading import Condition, Thread
from typing import Any

from actionlib_msgs.msg import GoalStatus

import rospy
from actionlib.action_server import ActionServer
from actionlib.server_goal_handle import ServerGoalHandle
from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "threading")

_REPLACED = "This goal was canceled because another goal was received by the simple action server"
_SLICE_S = 0.1
"""How long a wait lasts before it looks whether the node ends."""


class SimpleActionServer:
    """Works on one goal at a time.

    Args:
        name: of the action.
        ActionSpec: its class, whose name ends in Action.
        execute_cb: called with each goal, in a thread of its own; it should end when `is_preempt_requested`,
        and
            must say how the goal ended. None: goals are taken with `accept_new_goal`.
        auto_start: start at once. Better pass False and call `start`.
    """

    def __init__(
        self,
        name: str,
        ActionSpec: Any,
        execute_cb: Callable[[Any], object] | None = None,
        auto_start: bool = True,
    ) -> None:
        self.new_goal = False
        self.preempt_request = False
        self.new_goal_preempt_request = False
        self.execute_callback = execute_cb
        self.goal_callback: Callable[[], object] | None = None
        self.preempt_callback: Callable[[], object] | None = None
        self.need_to_terminate = False
        self.current_goal = ServerGoalHandle()
        self.next_goal = ServerGoalHandle()
        self.action_server = ActionServer(
            name, ActionSpec, self.internal_goal_callback, self.internal_preempt_callback, False
        )
        # One lock for both: no two threads can take two of them in different order.
        self.lock = self.action_server.lock
        self.execute_condition = Condition(self.lock)
        self.execute_thread: Thread | None = None
        if execute_cb:
            self.execute_thread = Thread(target=self.executeLoop, name=f"goals of {name}")
            self.execute_thread.start()
        if auto_start:
            rospy.logwarn(
                "The action server %s starts by itself: goals may come before its constructor has returned. "
                "Better pass auto_start=False and call start().",
                name,
            )
            self.start()

    def start(self) -> None:
        """Takes goals from now on."""
        self.action_server.start()

    def stop(self) -> None:
        """Takes no goals any more, and ends the thread that works on them after its current goal."""
        with self.lock:
            self.need_to_terminate = True
            self.execute_condition.notify_all()
        if self.action_server.started:
            self.action_server.stop()

    def accept_new_goal(self) -> Any:
        """Takes the new goal, which ends the one before as cancelled. Returns what its client asked for.

        Returns None, and logs an error, where there is no new goal.
        """
        with self.lock:
            if not self.new_goal or not self.next_goal.get_goal():
                rospy.logerr("there is no new goal to accept")
                return None
            if self.is_active() and self.current_goal != self.next_goal:
                self.current_goal.set_canceled(None, _REPLACED)
            self.current_goal = self.next_goal
            self.new_goal = False
            self.preempt_request, self.new_goal_preempt_request = self.new_goal_preempt_request, False
            self.current_goal.set_accepted("This goal has been accepted by the simple action server")
            return self.current_goal.get_goal()

    def is_new_goal_available(self) -> bool:
        """Whether there is a goal to accept."""
        return self.new_goal

    def is_preempt_requested(self) -> bool:
        """Whether the current goal should end: it was cancelled, or a new goal waits."""
        return self.preempt_request

    def is_active(self) -> bool:
        """Whether a goal is worked on."""
        with self.lock:
            if not self.current_goal.get_goal():
                return False
            return self.current_goal.get_goal_status().status in (GoalStatus.ACTIVE, GoalStatus.PREEMPTING)

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """The current goal is reached."""
        with self.lock:  # while a new goal is being accepted, the one before is not meant any more
            self.current_goal.set_succeeded(result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """The current goal failed."""
        with self.lock:
            self.current_goal.set_aborted(result, text)

    def set_preempted(self, result: Any = None, text: str = "") -> None:
        """The current goal ended because it was asked to."""
        with self.lock:
            self.current_goal.set_canceled(result, text)

    def publish_feedback(self, feedback: Any) -> None:
        """Tells the client how the current goal goes."""
        with self.lock:
            self.current_goal.publish_feedback(feedback)

    def get_default_result(self) -> Any:
        """A result with all fields at their defaults."""
        return self.action_server.ActionResultType()

    def register_goal_callback(self, cb: Callable[[], object]) -> None:
        """Calls `cb()` when a new goal waits. Not together with `execute_cb`."""
        if self.execute_callback:
            rospy.logwarn("An action server with execute_cb has no goal callback: it is not registered.")
        else:
            self.goal_callback = cb

    def register_preempt_callback(self, cb: Callable[[], object]) -> None:
        """Calls `cb()` when the current goal should end."""
        self.preempt_callback = cb

    def internal_goal_callback(self, goal: ServerGoalHandle) -> None:
        """Called with each new goal."""
        with self.lock:
            stamp = goal.get_goal_id().stamp
            others = [other for other in (self.current_goal, self.next_goal) if other.get_goal()]
            if any(stamp < other.get_goal_id().stamp for other in others):
                goal.set_canceled(None, _REPLACED)
                return
            if self.new_goal and self.next_goal != self.current_goal:
                self.next_goal.set_canceled(None, _REPLACED)
            self.next_goal = goal
            self.new_goal = True
            self.new_goal_preempt_request = False
            is_preempting = self.is_active()
            if is_preempting:
                self.preempt_request = True
            self.execute_condition.notify_all()
        if is_preempting:
            _call(self.preempt_callback)
        _call(self.goal_callback)

    def internal_preempt_callback(self, preempt: ServerGoalHandle) -> None:
        """Called with each goal that was cancelled."""
        with self.lock:
            is_current = preempt == self.current_goal
            if is_current:
                self.preempt_request = True
            elif preempt == self.next_goal:
                self.new_goal_preempt_request = True
        if is_current:
            _call(self.preempt_callback)

    def executeLoop(self) -> None:
        """Works on goals until the node ends, in a thread of its own."""
        while not rospy.is_shutdown():
            with self.execute_condition:
                if self.need_to_terminate:
                    return
                if not self.new_goal:
                    self.execute_condition.wait(_SLICE_S)
                    continue
                goal = self.accept_new_goal()
            self._execute(goal)

    def _execute(self, goal: Any) -> None:
        assert self.execute_callback is not None  # noqa: S101 # the thread runs only with one
        worked_on = self.current_goal
        try:
            self.execute_callback(goal)
        except Exception as error:
            rospy.logerr("execute_cb raised %s\n%s", error, traceback.format_exc())
            self._abort(worked_on, f"Exception in execute callback: {error}")
            return
        if self.is_active():
            rospy.logwarn(
                "execute_cb returned without set_succeeded, set_aborted or set_preempted: it is aborted."
            )
            self._abort(worked_on, "No terminal state was set.")

    def _abort(self, goal: ServerGoalHandle, text: str) -> None:
        if goal.get_goal() and goal.get_goal_status().status in (GoalStatus.ACTIVE, GoalStatus.PREEMPTING):
            goal.set_aborted(None, text)


def _call(callback: Callable[[], object] | None) -> None:
    """Calls a user's function; what it raises is logged, as goals must go on."""
    if callback is None:
        return
    try:
        callback()
    except Exception as error:
        rospy.logerr("a callback of an action server raised %s\n%s", error, traceback.format_exc())
