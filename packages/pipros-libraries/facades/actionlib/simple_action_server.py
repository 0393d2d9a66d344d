"""`SimpleActionServer`, which executes one goal at a time; a new goal preempts the current one."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from threading import Condition, Thread
from typing import Any

from actionlib_msgs.msg import GoalStatus

import rospy
from actionlib.action_server import ActionServer
from actionlib.server_goal_handle import ServerGoalHandle
from pipros.basics import one_thread
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "threading")

_REPLACED = "This goal was canceled because another goal was received by the simple action server"
_SLICE_S = 0.1
"""Maximum interval between checks for shutdown while waiting."""
_GRACE_S = 0.2
"""Maximum time that the process waits for `execute_cb` after shutdown."""


class SimpleActionServer:
    """Action server that executes one goal at a time.

    A new goal requests preemption of the current goal and cancels a goal that is still pending. If either
    goal has a later timestamp, the new goal is cancelled instead. Methods may be called from any thread.

    Args:
        name: namespace of the action.
        ActionSpec: action class, whose name ends in Action.
        execute_cb: called with each goal message in a dedicated thread. It should return when
            `is_preempt_requested` is true, and must set the final status. If None, the program calls
            `accept_new_goal` instead.
        auto_start: whether to start immediately. True is deprecated: pass False and call `start`.
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
        # Both servers share one lock, so the order of acquiring locks does not matter.
        self.lock = self.action_server.lock
        self.execute_condition = Condition(self.lock)
        self.execute_thread: Thread | None = None
        if execute_cb and not one_thread.has_threads():
            one_thread.start_work(self.executeLoop, self._execute_in_turn, name=f"goals of {name}")
        elif execute_cb:
            self.execute_thread = Thread(target=self.executeLoop, name=f"goals of {name}", daemon=True)
            self.execute_thread.start()
            # As in Noetic, a program keeps serving until shutdown, even without `rospy.spin()`.
            Thread(target=self._keep_process, name=f"server of {name}").start()
        if auto_start:
            rospy.logwarn(
                "Action server [%s] uses auto_start: goals may arrive before the constructor has returned. "
                "Pass auto_start=False and call start().",
                name,
            )
            self.start()

    def start(self) -> None:
        """Start accepting goals."""
        self.action_server.start()

    def stop(self) -> None:
        """Stop accepting goals, and end the execution thread after its current goal, without waiting."""
        with self.lock:
            self.need_to_terminate = True
            self.execute_condition.notify_all()
        if self.action_server.started:
            self.action_server.stop()

    def accept_new_goal(self) -> Any:
        """Accept the pending goal and return its goal message. If a goal is active, cancel it.

        If there is no pending goal, log an error and return None.
        """
        with self.lock:
            if not self.new_goal or not self.next_goal.get_goal():
                rospy.logerr("accept_new_goal was called without a pending goal")
                return None
            if self.is_active() and self.current_goal != self.next_goal:
                self.current_goal.set_canceled(None, _REPLACED)
            self.current_goal = self.next_goal
            self.new_goal = False
            self.preempt_request, self.new_goal_preempt_request = self.new_goal_preempt_request, False
            self.current_goal.set_accepted("This goal has been accepted by the simple action server")
            return self.current_goal.get_goal()

    def is_new_goal_available(self) -> bool:
        """Return whether a goal is pending."""
        return self.new_goal

    def is_preempt_requested(self) -> bool:
        """Return whether the current goal should end, because it was cancelled or a new goal is pending."""
        return self.preempt_request

    def is_active(self) -> bool:
        """Return whether the current goal is ACTIVE or PREEMPTING."""
        with self.lock:
            if not self.current_goal.get_goal():
                return False
            return self.current_goal.get_goal_status().status in (GoalStatus.ACTIVE, GoalStatus.PREEMPTING)

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the current goal as SUCCEEDED."""
        with self.lock:  # the lock prevents `accept_new_goal` from replacing the goal in the meantime
            self.current_goal.set_succeeded(result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the current goal as ABORTED."""
        with self.lock:
            self.current_goal.set_aborted(result, text)

    def set_preempted(self, result: Any = None, text: str = "") -> None:
        """End the current goal as PREEMPTED."""
        with self.lock:
            self.current_goal.set_canceled(result, text)

    def publish_feedback(self, feedback: Any) -> None:
        """Publish feedback for the current goal."""
        with self.lock:
            self.current_goal.publish_feedback(feedback)

    def get_default_result(self) -> Any:
        """Return a result with default values."""
        return self.action_server.ActionResultType()

    def register_goal_callback(self, cb: Callable[[], object]) -> None:
        """Set the function to call without arguments for a new goal. Ignored if `execute_cb` is set."""
        if self.execute_callback:
            rospy.logwarn("goal callback ignored: an action server with execute_cb does not call it")
        else:
            self.goal_callback = cb

    def register_preempt_callback(self, cb: Callable[[], object]) -> None:
        """Set the function to call without arguments when preemption of the current goal is requested."""
        self.preempt_callback = cb

    def internal_goal_callback(self, goal: ServerGoalHandle) -> None:
        """Handle a new goal from the underlying ActionServer."""
        with self.lock:
            others = [other for other in (self.current_goal, self.next_goal) if other.get_goal()]
            if any(_is_older(goal, other) for other in others):
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
        """Handle a cancellation request from the underlying ActionServer."""
        with self.lock:
            is_current = preempt == self.current_goal
            if is_current:
                self.preempt_request = True
            elif preempt == self.next_goal:
                self.new_goal_preempt_request = True
        if is_current:
            _call(self.preempt_callback)

    def executeLoop(self) -> None:
        """Execute goals until the node or the server is shut down. Runs in the execution thread."""
        while not rospy.is_shutdown():
            with self.execute_condition:
                if self.need_to_terminate:
                    return
                if not self.new_goal:
                    self.execute_condition.wait(_SLICE_S)
                    continue
                goal = self.accept_new_goal()
            self._execute(goal)

    def _execute_in_turn(self) -> float | None:
        """Execute a pending goal, where there are no threads; see `one_thread.start_work`."""
        with self.lock:
            if self.need_to_terminate or rospy.is_shutdown():
                return None
            goal = self.accept_new_goal() if self.new_goal else None
        if goal is not None:
            self._execute(goal)
        return _SLICE_S

    def _keep_process(self) -> None:
        """Keep the interpreter alive while the server is running, and briefly after shutdown.

        `execute_cb` may block forever, so it runs in a daemon thread. A callback that notices the shutdown
        has `_GRACE_S` seconds to finish.
        """
        assert self.execute_thread is not None  # noqa: S101 # set before this thread starts
        while self.execute_thread.is_alive() and not rospy.is_shutdown():
            self.execute_thread.join(_SLICE_S)
        self.execute_thread.join(_GRACE_S)

    def _execute(self, goal: Any) -> None:
        assert self.execute_callback is not None  # noqa: S101 # without execute_cb, there is no thread
        executed = self.current_goal
        try:
            self.execute_callback(goal)
        except Exception as error:
            rospy.logerr("execute_cb raised %s\n%s", error, traceback.format_exc())
            self._abort(executed, f"Exception in execute callback: {error}")
            return
        if self.is_active():
            rospy.logwarn(
                "execute_cb returned without calling set_succeeded, set_aborted or set_preempted: "
                "aborting the goal"
            )
            self._abort(executed, "No terminal state was set.")

    def _abort(self, goal: ServerGoalHandle, text: str) -> None:
        if goal.get_goal() and goal.get_goal_status().status in (GoalStatus.ACTIVE, GoalStatus.PREEMPTING):
            goal.set_aborted(None, text)


def _is_older(goal: ServerGoalHandle, other: ServerGoalHandle) -> bool:
    """Return whether a goal has an older stamp. Stamps from before a jump back of the clock do not count."""
    is_comparable = goal.status_tracker.epoch == other.status_tracker.epoch
    return is_comparable and bool(goal.get_goal_id().stamp < other.get_goal_id().stamp)


def _call(callback: Callable[[], object] | None) -> None:
    """Call a user's function and log any exception, so that later goals are still processed."""
    if callback is None:
        return
    try:
        callback()
    except Exception as error:
        rospy.logerr("callback of the action server raised %s\n%s", error, traceback.format_exc())
