"""`ActionClient`, which sends and tracks any number of goals."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import count
from threading import Event, RLock
from time import monotonic
from traceback import format_exc
from typing import Any
from weakref import ref

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

import rospy
from actionlib.action_types import ActionTypes
from actionlib.exceptions import ActionException as ActionException
from pipros.basics.lazy_names import star_names as _star_names
from pipros_libraries.actions.client_goal import MAY_BE_CANCELLED, ClientGoal, ClientGoalState
from pipros_libraries.actions.status import TERMINAL, Status

_star_names(__name__, "std_msgs.msg:Header threading time weakref")

_numbers = count(1)
_POLL_S = 0.01


def get_name_of_constant(C: Any, n: int) -> str:
    """Return the name of the constant in class `C` with the value `n`, or `NO_SUCH_STATE_<n>`."""
    for name, value in C.__dict__.items():
        if isinstance(value, int) and value == n:
            return str(name)
    return f"NO_SUCH_STATE_{n}"


class CommState:
    """States of a goal, as tracked by the client."""

    WAITING_FOR_GOAL_ACK = ClientGoalState.WAITING_FOR_GOAL_ACK.value
    PENDING = ClientGoalState.PENDING.value
    ACTIVE = ClientGoalState.ACTIVE.value
    WAITING_FOR_RESULT = ClientGoalState.WAITING_FOR_RESULT.value
    WAITING_FOR_CANCEL_ACK = ClientGoalState.WAITING_FOR_CANCEL_ACK.value
    RECALLING = ClientGoalState.RECALLING.value
    PREEMPTING = ClientGoalState.PREEMPTING.value
    DONE = ClientGoalState.DONE.value
    LOST = ClientGoalState.LOST.value

    to_string = classmethod(get_name_of_constant)


class TerminalState:
    """Final states of a goal."""

    RECALLED = GoalStatus.RECALLED
    REJECTED = GoalStatus.REJECTED
    PREEMPTED = GoalStatus.PREEMPTED
    ABORTED = GoalStatus.ABORTED
    SUCCEEDED = GoalStatus.SUCCEEDED
    LOST = GoalStatus.LOST

    to_string = classmethod(get_name_of_constant)


GoalStatus.to_string = classmethod(get_name_of_constant)  # type: ignore[attr-defined]


class CommStateMachine:
    """Client-side state of one goal, and its callbacks.

    Transition callbacks run one at a time, in the order of the transitions. No lock is held, so callbacks may
    call any method. Transitions that occur during a callback are reported after the callback returns.
    """

    def __init__(
        self, action_goal: Any, transition_cb: Any, feedback_cb: Any, send_goal_fn: Any, send_cancel_fn: Any
    ) -> None:
        self.action_goal = action_goal
        self.transition_cb = transition_cb
        self.feedback_cb = feedback_cb
        self.send_goal_fn = send_goal_fn
        self.send_cancel_fn = send_cancel_fn
        self.mutex = RLock()
        self.latest_goal_status = GoalStatus(status=GoalStatus.PENDING)
        self.latest_result: Any = None
        self._goal = ClientGoal()
        self._reported = ClientGoalState.WAITING_FOR_GOAL_ACK
        self._unreported: deque[ClientGoalState] = deque()
        self._is_notifying = False

    @property
    def state(self) -> int:
        """The last state reported to the callback: a constant of CommState."""
        return int(self._reported)

    def __eq__(self, o: object) -> bool:
        return isinstance(o, CommStateMachine) and self.goal_id == o.goal_id

    def __hash__(self) -> int:
        return hash(self.goal_id)

    @property
    def goal_id(self) -> str:
        """The goal ID."""
        return str(self.action_goal.goal_id.id)

    def cancel(self) -> None:
        """Request cancellation of the goal. Do nothing if the goal is already ending."""
        with self.mutex:
            if self._goal.state not in MAY_BE_CANCELLED:
                return
            self.send_cancel_fn(GoalID(rospy.Time(0), self.goal_id))
            self._unreported.extend(self._goal.on_cancel())
        self._notify()

    def update_status(self, status_array: Any) -> None:
        """Handle a status list from the server."""
        with self.mutex:
            if self._goal.state is ClientGoalState.DONE:
                return
            found = next((each for each in status_array.status_list if each.goal_id.id == self.goal_id), None)
            if found is not None:
                self.latest_goal_status = found
            try:
                states = self._goal.on_status(None if found is None else found.status, monotonic())
            except ValueError as error:
                rospy.logerr("goal %s: %s", self.goal_id, error)
                return
            if self._goal.status is Status.LOST:
                self.latest_goal_status.status = GoalStatus.LOST
            self._unreported.extend(states)
        self._notify()

    def update_result(self, action_result: Any) -> None:
        """Handle the result for this goal. Results for other goals are ignored."""
        if action_result.status.goal_id.id != self.goal_id:
            return
        with self.mutex:
            if self._goal.state is ClientGoalState.DONE:
                rospy.logerr("goal %s: received another result after it was done", self.goal_id)
                return
            self.latest_goal_status = action_result.status
            self.latest_result = action_result
            self._unreported.extend(self._goal.on_result(action_result.status.status))
        self._notify()

    def update_feedback(self, action_feedback: Any) -> None:
        """Pass feedback for this goal to the feedback callback. Feedback for other goals is ignored."""
        if action_feedback.status.goal_id.id != self.goal_id:
            return
        if self.feedback_cb and self._goal.state is not ClientGoalState.DONE:
            self.feedback_cb(ClientGoalHandle(self), action_feedback.feedback)

    def _notify(self) -> None:
        while True:
            with self.mutex:
                if self._is_notifying or not self._unreported:
                    return  # another thread is notifying, and will report this transition, too
                self._is_notifying = True
                self._reported = self._unreported.popleft()
            try:
                if self.transition_cb:
                    self.transition_cb(ClientGoalHandle(self))
            except Exception as error:
                rospy.logerr("callback of the action client raised %s\n%s", error, format_exc())
            finally:
                self._is_notifying = False


class ClientGoalHandle:
    """Handle for a goal that was sent. The client tracks the goal until its last handle is deleted."""

    def __init__(self, comm_state_machine: CommStateMachine) -> None:
        self.comm_state_machine = comm_state_machine

    def __eq__(self, o: object) -> bool:
        return isinstance(o, ClientGoalHandle) and self.comm_state_machine == o.comm_state_machine

    def __ne__(self, o: object) -> bool:
        return not self == o

    def __hash__(self) -> int:
        return hash(self.comm_state_machine)

    def cancel(self) -> None:
        """Request cancellation of the goal. Do nothing if the goal is already ending."""
        self.comm_state_machine.cancel()

    def get_comm_state(self) -> int:
        """Return the state of the goal, a constant of CommState."""
        return self.comm_state_machine.state

    def get_goal_status(self) -> int:
        """Return the last known status, a constant of GoalStatus; PENDING until the server reports one."""
        return self.comm_state_machine.latest_goal_status.status

    def get_goal_status_text(self) -> str:
        """Return the text that the server sent with its last status."""
        return self.comm_state_machine.latest_goal_status.text

    def get_result(self) -> Any:
        """Return the result, or None if it has not been received yet."""
        result = self.comm_state_machine.latest_result
        return None if result is None else result.result

    def get_terminal_state(self) -> int:
        """Return the final state, a constant of TerminalState.

        If the goal is not DONE, or its last status is not final, log an error. In this case, return the last
        status if it is final, otherwise LOST.
        """
        with self.comm_state_machine.mutex:
            status = self.comm_state_machine.latest_goal_status.status
            if self.comm_state_machine.state == CommState.DONE and status in TERMINAL:
                return status
            rospy.logerr("goal %s has not ended", self.comm_state_machine.goal_id)
            return status if status in TERMINAL else GoalStatus.LOST


class GoalManager:
    """Registry of a client's goals. A goal is removed when its last handle is deleted."""

    def __init__(self, ActionSpec: Any) -> None:
        types = ActionTypes(ActionSpec)
        self.ActionSpec = ActionSpec
        self.ActionGoal, self.ActionResult, self.ActionFeedback = types.goal, types.result, types.feedback
        self.list_mutex = RLock()
        self.statuses: list[ref[CommStateMachine]] = []
        self.send_goal_fn: Any = None
        self.cancel_fn: Any = None

    def register_send_goal_fn(self, fn: Callable[[Any], object]) -> None:
        """Set the function that sends goals."""
        self.send_goal_fn = fn

    def register_cancel_fn(self, fn: Callable[[Any], object]) -> None:
        """Set the function that sends cancellation requests."""
        self.cancel_fn = fn

    def init_goal(self, goal: Any, transition_cb: Any = None, feedback_cb: Any = None) -> ClientGoalHandle:
        """Send a goal with a new goal ID and return its handle."""
        now = rospy.Time.now()
        goal_id = GoalID(now, f"{rospy.get_caller_id()}-{next(_numbers)}-{now.to_sec():.3f}")
        action_goal = self.ActionGoal(goal_id=goal_id, goal=goal)
        action_goal.header.stamp = now
        machine = CommStateMachine(action_goal, transition_cb, feedback_cb, self.send_goal_fn, self.cancel_fn)
        handle = ClientGoalHandle(machine)
        with self.list_mutex:
            self.statuses.append(ref(machine))
        self.send_goal_fn(action_goal)
        return handle

    def update_statuses(self, status_array: Any) -> None:
        """Pass a status list from the server to all goals."""
        for machine in self._tracked():
            machine.update_status(status_array)

    def update_results(self, action_result: Any) -> None:
        """Pass a result to its goal."""
        for machine in self._tracked():
            machine.update_result(action_result)

    def update_feedbacks(self, action_feedback: Any) -> None:
        """Pass a feedback message to its goal."""
        for machine in self._tracked():
            machine.update_feedback(action_feedback)

    def _tracked(self) -> list[CommStateMachine]:
        with self.list_mutex:
            pairs = [(each, each()) for each in self.statuses]
            self.statuses = [each for each, machine in pairs if machine is not None]
            return [machine for _, machine in pairs if machine is not None]


class ActionClient:
    """Client of the action server `ns`. Tracks any number of goals.

    Callbacks run in threads of the node, or in the thread that cancels the goal.

    Raises:
        ActionException: `ActionSpec` is not the class of an action.
    """

    def __init__(self, ns: str, ActionSpec: Any) -> None:
        self.ns = ns
        self.last_status_msg: Any = None
        self.manager = GoalManager(ActionSpec)
        self.ActionSpec = ActionSpec
        self.ActionGoal = self.manager.ActionGoal
        self.ActionResult = self.manager.ActionResult
        self.ActionFeedback = self.manager.ActionFeedback
        name: str = rospy.remap_name(ns) + "/"
        size = rospy.get_param("actionlib_client_pub_queue_size", 10)
        self.pub_queue_size = 10 if size < 0 else size
        self.pub_goal = rospy.Publisher(f"{name}goal", self.ActionGoal, queue_size=self.pub_queue_size)
        self.pub_cancel = rospy.Publisher(f"{name}cancel", GoalID, queue_size=self.pub_queue_size)
        self.manager.register_send_goal_fn(self.pub_goal.publish)
        self.manager.register_cancel_fn(self.pub_cancel.publish)
        size = rospy.get_param("actionlib_client_sub_queue_size", -1)
        self.sub_queue_size = None if size < 0 else size
        more: dict[str, Any] = {"queue_size": self.sub_queue_size}
        self.status_sub = rospy.Subscriber(f"{name}status", GoalStatusArray, self._status_cb, **more)
        self.result_sub = rospy.Subscriber(f"{name}result", self.ActionResult, self._result_cb, **more)
        self.feedback_sub = rospy.Subscriber(
            f"{name}feedback", self.ActionFeedback, self._feedback_cb, **more
        )

    def stop(self) -> None:
        """Unregister from all topics."""
        for part in (self.pub_goal, self.pub_cancel, self.status_sub, self.result_sub, self.feedback_sub):
            part.unregister()

    def send_goal(self, goal: Any, transition_cb: Any = None, feedback_cb: Any = None) -> ClientGoalHandle:
        """Send a goal and return its handle. The goal is tracked only as long as the handle exists.

        Args:
            transition_cb: called with a handle on each transition of CommState.
            feedback_cb: called with a handle and the feedback message.
        """
        return self.manager.init_goal(goal, transition_cb, feedback_cb)

    def cancel_all_goals(self) -> None:
        """Request cancellation of all goals from all clients."""
        self.pub_cancel.publish(GoalID())

    def cancel_goals_at_and_before_time(self, time: Any) -> None:
        """Request cancellation of all goals, from all clients, with a timestamp at or before `time`."""
        self.pub_cancel.publish(GoalID(time, ""))

    def wait_for_action_server_to_start(self, timeout: Any = rospy.Duration(0.0)) -> bool:  # noqa: B008
        """Same as `wait_for_server`."""
        return self.wait_for_server(timeout)

    def wait_for_server(self, timeout: Any = rospy.Duration(0.0)) -> bool:  # noqa: B008
        """Wait until a server is connected on all topics. If `timeout` is zero, wait indefinitely.

        Return False if the timeout expires or the node is shut down first.
        """
        end = rospy.get_rostime() + timeout
        never = Event()
        while not rospy.is_shutdown():
            if self._has_server():
                return True
            now = rospy.get_rostime()
            end = min(end, now + timeout)  # the clock may have moved back
            if not timeout.is_zero() and now >= end:
                return False
            never.wait(_POLL_S)
        return False

    def _has_server(self) -> bool:
        if self.last_status_msg is None:
            return False
        server = self.last_status_msg._connection_header["callerid"]
        goals, cancels = self.pub_goal.impl, self.pub_cancel.impl
        if not (goals and cancels and goals.has_connection(server) and cancels.has_connection(server)):
            return False
        return all(
            any(link.callerid_pub == server for link in subscriber.impl.connections)
            for subscriber in (self.result_sub, self.feedback_sub)
            if subscriber.impl
        )

    def _status_cb(self, msg: Any) -> None:
        self.last_status_msg = msg
        self.manager.update_statuses(msg)

    def _result_cb(self, msg: Any) -> None:
        self.manager.update_results(msg)

    def _feedback_cb(self, msg: Any) -> None:
        self.manager.update_feedbacks(msg)
