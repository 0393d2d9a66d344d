"""`ActionClient`: sends any number of goals, and follows each of them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import count
from threading import Event, RLock
from traceback import format_exc
from typing import Any
from weakref import ref

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

import rospy
from actionlib.action_types import ActionTypes
from actionlib.exceptions import ActionException as ActionException
from pipros.actions.client_goal import MAY_BE_CANCELLED, ClientGoal, State
from pipros.actions.status import TERMINAL
from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "std_msgs.msg:Header threading time weakref")

_numbers = count(1)
_POLL_S = 0.01


def get_name_of_constant(C: Any, n: int) -> str:
    """The name of a number among the constants of a class."""
    for name, value in C.__dict__.items():
        if isinstance(value, int) and value == n:
            return str(name)
    return f"NO_SUCH_STATE_{n}"


class CommState:
    """The states of a client's goal."""

    WAITING_FOR_GOAL_ACK = 0
    PENDING = 1
    ACTIVE = 2
    WAITING_FOR_RESULT = 3
    WAITING_FOR_CANCEL_ACK = 4
    RECALLING = 5
    PREEMPTING = 6
    DONE = 7
    LOST = 8

    to_string = classmethod(get_name_of_constant)


class TerminalState:
    """How a goal may have ended."""

    RECALLED = GoalStatus.RECALLED
    REJECTED = GoalStatus.REJECTED
    PREEMPTED = GoalStatus.PREEMPTED
    ABORTED = GoalStatus.ABORTED
    SUCCEEDED = GoalStatus.SUCCEEDED
    LOST = GoalStatus.LOST

    to_string = classmethod(get_name_of_constant)


GoalStatus.to_string = classmethod(get_name_of_constant)  # type: ignore[attr-defined]


class CommStateMachine:
    """A goal that was sent: where it is, and whom to tell.

    Callbacks come one at a time, in the order of the states, and without a lock: they may do what they like.
    Changes that occur during the callback, also because of it, are reported after it.
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
        self._told = State.WAITING_FOR_GOAL_ACK
        self._untold: deque[State] = deque()
        self._is_telling = False

    @property
    def state(self) -> int:
        """One of CommState."""
        return int(self._told)

    def __eq__(self, o: object) -> bool:
        return isinstance(o, CommStateMachine) and self.goal_id == o.goal_id

    def __hash__(self) -> int:
        return hash(self.goal_id)

    @property
    def goal_id(self) -> str:
        """The id of the goal."""
        return str(self.action_goal.goal_id.id)

    def cancel(self) -> None:
        """Asks the server to end the goal. Nothing happens where it ends already."""
        with self.mutex:
            if self._goal.state not in MAY_BE_CANCELLED:
                return
            self.send_cancel_fn(GoalID(rospy.Time(0), self.goal_id))
            self._untold.extend(self._goal.on_cancel())
        self._tell()

    def update_status(self, status_array: Any) -> None:
        """The statuses that the server published."""
        with self.mutex:
            wanted = self.goal_id
            found = next((each for each in status_array.status_list if each.goal_id.id == wanted), None)
            if found is not None and self._goal.state is not State.DONE:
                self.latest_goal_status = found
            try:
                way = self._goal.on_status(None if found is None else found.status)
            except ValueError as error:
                rospy.logerr("goal %s: %s", wanted, error)
                return
            if found is None and way:
                self.latest_goal_status.status = GoalStatus.LOST
            self._untold.extend(way)
        self._tell()

    def update_result(self, action_result: Any) -> None:
        """A result of any goal."""
        if action_result.status.goal_id.id != self.goal_id:
            return
        with self.mutex:
            if self._goal.state is State.DONE:
                rospy.logerr("goal %s: a result came after its end", self.goal_id)
                return
            self.latest_goal_status = action_result.status
            self.latest_result = action_result
            self._untold.extend(self._goal.on_result(action_result.status.status))
        self._tell()

    def update_feedback(self, action_feedback: Any) -> None:
        """Feedback of any goal."""
        if action_feedback.status.goal_id.id != self.goal_id:
            return
        if self.feedback_cb and self._goal.state is not State.DONE:
            self.feedback_cb(ClientGoalHandle(self), action_feedback.feedback)

    def _tell(self) -> None:
        while True:
            with self.mutex:
                if self._is_telling or not self._untold:
                    return  # who is telling already will tell the rest
                self._is_telling = True
                self._told = self._untold.popleft()
            try:
                if self.transition_cb:
                    self.transition_cb(ClientGoalHandle(self))
            except Exception as error:
                rospy.logerr("a callback of an action client raised %s\n%s", error, format_exc())
            finally:
                self._is_telling = False


class ClientGoalHandle:
    """A goal that was sent. As long as a program holds it, the client follows the goal."""

    def __init__(self, comm_state_machine: CommStateMachine) -> None:
        self.comm_state_machine = comm_state_machine

    def __eq__(self, o: object) -> bool:
        return isinstance(o, ClientGoalHandle) and self.comm_state_machine == o.comm_state_machine

    def __ne__(self, o: object) -> bool:
        return not self == o

    def __hash__(self) -> int:
        return hash(self.comm_state_machine)

    def cancel(self) -> None:
        """Asks the server to end the goal. Nothing happens where it ends already."""
        self.comm_state_machine.cancel()

    def get_comm_state(self) -> int:
        """One of CommState."""
        return self.comm_state_machine.state

    def get_goal_status(self) -> int:
        """What the server said last, one of the constants of GoalStatus."""
        return self.comm_state_machine.latest_goal_status.status

    def get_goal_status_text(self) -> str:
        """What the server said with it."""
        return self.comm_state_machine.latest_goal_status.text

    def get_result(self) -> Any:
        """The result, None as long as there is none."""
        result = self.comm_state_machine.latest_result
        return None if result is None else result.result

    def get_terminal_state(self) -> int:
        """One of TerminalState; LOST, and an error in the log, where the goal has not ended."""
        with self.comm_state_machine.mutex:
            status = self.comm_state_machine.latest_goal_status.status
            if self.comm_state_machine.state == CommState.DONE and status in TERMINAL:
                return status
            rospy.logerr("goal %s has not ended", self.comm_state_machine.goal_id)
            return status if status in TERMINAL else GoalStatus.LOST


class GoalManager:
    """The goals of a client that a program still holds."""

    def __init__(self, ActionSpec: Any) -> None:
        types = ActionTypes(ActionSpec)
        self.ActionSpec = ActionSpec
        self.ActionGoal, self.ActionResult, self.ActionFeedback = types.goal, types.result, types.feedback
        self.list_mutex = RLock()
        self.statuses: list[ref[CommStateMachine]] = []
        self.send_goal_fn: Any = None
        self.cancel_fn: Any = None

    def register_send_goal_fn(self, fn: Callable[[Any], object]) -> None:
        """What sends goals."""
        self.send_goal_fn = fn

    def register_cancel_fn(self, fn: Callable[[Any], object]) -> None:
        """What sends requests to cancel."""
        self.cancel_fn = fn

    def init_goal(self, goal: Any, transition_cb: Any = None, feedback_cb: Any = None) -> ClientGoalHandle:
        """Sends a goal."""
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
        """The statuses that the server published."""
        for machine in self._living():
            machine.update_status(status_array)

    def update_results(self, action_result: Any) -> None:
        """A result."""
        for machine in self._living():
            machine.update_result(action_result)

    def update_feedbacks(self, action_feedback: Any) -> None:
        """Feedback."""
        for machine in self._living():
            machine.update_feedback(action_feedback)

    def _living(self) -> list[CommStateMachine]:
        with self.list_mutex:
            pairs = [(each, each()) for each in self.statuses]
            self.statuses = [each for each, machine in pairs if machine is not None]
            return [machine for _, machine in pairs if machine is not None]


class ActionClient:
    """Sends goals to the action server below the name `ns`.

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
        name = rospy.remap_name(ns)
        size = rospy.get_param("actionlib_client_pub_queue_size", 10)
        self.pub_queue_size = 10 if size < 0 else size
        self.pub_goal = rospy.Publisher(f"{name}/goal", self.ActionGoal, queue_size=self.pub_queue_size)
        self.pub_cancel = rospy.Publisher(f"{name}/cancel", GoalID, queue_size=self.pub_queue_size)
        self.manager.register_send_goal_fn(self.pub_goal.publish)
        self.manager.register_cancel_fn(self.pub_cancel.publish)
        size = rospy.get_param("actionlib_client_sub_queue_size", -1)
        self.sub_queue_size = None if size < 0 else size
        more: dict[str, Any] = {"queue_size": self.sub_queue_size}
        self.status_sub = rospy.Subscriber(f"{name}/status", GoalStatusArray, self._status_cb, **more)
        self.result_sub = rospy.Subscriber(f"{name}/result", self.ActionResult, self._result_cb, **more)
        self.feedback_sub = rospy.Subscriber(
            f"{name}/feedback", self.ActionFeedback, self._feedback_cb, **more
        )

    def stop(self) -> None:
        """Leaves all topics."""
        for part in (self.pub_goal, self.pub_cancel, self.status_sub, self.result_sub, self.feedback_sub):
            part.unregister()

    def send_goal(self, goal: Any, transition_cb: Any = None, feedback_cb: Any = None) -> ClientGoalHandle:
        """Sends a goal. Keep the handle: without it the goal is no longer tracked.

        Args:
            transition_cb: called with a handle at each new state.
            feedback_cb: called with a handle and the feedback.
        """
        return self.manager.init_goal(goal, transition_cb, feedback_cb)

    def cancel_all_goals(self) -> None:
        """Asks the server to end all goals, of all clients."""
        self.pub_cancel.publish(GoalID())

    def cancel_goals_at_and_before_time(self, time: Any) -> None:
        """Asks the server to end all goals, of all clients, with this stamp or an earlier one."""
        self.pub_cancel.publish(GoalID(time, ""))

    def wait_for_action_server_to_start(self, timeout: Any = rospy.Duration(0.0)) -> bool:  # noqa: B008
        """The same as `wait_for_server`."""
        return self.wait_for_server(timeout)

    def wait_for_server(self, timeout: Any = rospy.Duration(0.0)) -> bool:  # noqa: B008
        """Waits until a server is connected on all topics; for ever where `timeout` is zero.

        Returns False where it is not in that time, or the node ends.
        """
        end = rospy.get_rostime() + timeout
        never = Event()
        while not rospy.is_shutdown():
            if self._has_server():
                return True
            if not timeout.is_zero() and rospy.get_rostime() >= end:
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
