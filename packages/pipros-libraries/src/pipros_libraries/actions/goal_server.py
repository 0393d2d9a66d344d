"""A simple action server on a `Node`, which executes one goal at a time. A new goal replaces the current one.

The status texts are the same as in actionlib. Goals and cancellations arrive in threads other than the one
that executes goals.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.intervals import ClockWatch, elapsed
from pipros.basics.names import NAME_CHARACTERS
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.clock import stamp
from pipros_libraries.actions.feedback_first import FeedbackFirst
from pipros_libraries.actions.goal_table import GoalTable
from pipros_libraries.actions.server_goal import GoalEvent, after
from pipros_libraries.actions.status import TERMINAL, Status
from pipros_libraries.nodes.schedule import Schedule
from pipros_libraries.nodes.wiring import advertise, stamped, subscribe
from pipros_libraries.transforms.messages import in_ns

REPLACED: Final = "This goal was canceled because another goal was recieved by the simple action server"
"""The text of actionlib in C++, including its misspelling, which actionlib in Python does not have."""
_ACCEPTED: Final = "This goal has been accepted by the simple action server"
_KEPT_NS: Final = 5_000_000_000
_STATUS_S: Final = 0.2

STATUSES_AT_ONCE: Final = 100
"""Number of goals up to which each change publishes the status of all goals at once.

With more, only the periodic message has them: 500 goals in a second would cost more than a processor.
"""


@dataclass(slots=True, eq=False)
class Goal:
    """A client's goal: its content, its status message, the epoch it arrived in, and when it ended.

    A changed status is a new message, because earlier ones may still be on their way to subscribers.
    """

    content: Any
    status: Any
    epoch: int = 0
    ended_ns: int = 0


class GoalServer:
    """Receives goals and cancellations, and publishes status, feedback and results.

    Attributes:
        is_cancelled: whether the current goal should end, because a client cancelled it.
    """

    def __init__(
        self, node: Node, name: str, action: str, schedule: Schedule, on_goal: Callable[[], object]
    ) -> None:
        """Register the topics of an action such as `move_base_msgs/MoveBase`.

        Args:
            on_goal: called after each message with a goal. No lock is held.
        """
        self._node, self._action, self._notify = node, action, on_goal
        self._lock = threading.RLock()
        self._current: Goal | None = None
        self._next: Goal | None = None
        self.is_cancelled = self._is_next_cancelled = False
        self._last_cancel_ns = self._count = self._epoch = 0
        self._watch, self._feedback_first = ClockWatch(), FeedbackFirst()
        sizes = node.limits.goals, NAME_CHARACTERS
        self._goals: GoalTable[Goal] = GoalTable(*sizes, lambda goal: goal.ended_ns > 0)
        self._statuses = advertise(node, f"{name}/status", "actionlib_msgs/GoalStatusArray", 50, latch=True)
        self._results = advertise(node, f"{name}/result", f"{action}ActionResult", 50)
        self._feedback = advertise(node, f"{name}/feedback", f"{action}ActionFeedback", 50)
        subscribe(node, f"{name}/goal", f"{action}ActionGoal", self._on_goal, 50)
        subscribe(node, f"{name}/cancel", "actionlib_msgs/GoalID", self._on_cancel, 50)
        schedule.every(_STATUS_S, self._publish_statuses)
        self._publish_statuses()

    # -- called by the executing thread ------------------------------------------

    @property
    def has_new_goal(self) -> bool:
        return self._next is not None

    @property
    def is_active(self) -> bool:
        status = None if self._current is None else self._current.status.status
        return status in (Status.ACTIVE, Status.PREEMPTING)

    def accept(self) -> Any:
        """Accept the new goal, and return its content. If a goal is active, it ends as PREEMPTED."""
        with self._lock:
            goal, self._next = self._next, None
            if goal is None:
                raise RuntimeError("accept was called without a new goal")
            if self.is_active:
                self._end(self._current, GoalEvent.CANCEL, REPLACED)
            self._current = goal
            self.is_cancelled, self._is_next_cancelled = self._is_next_cancelled, False
            self._change(goal, GoalEvent.ACCEPT, _ACCEPTED)
            self._publish_change()
            return goal.content

    def end(self, event: GoalEvent, text: str) -> None:
        """End the current goal."""
        with self._lock:
            self.is_cancelled = False
            self._end(self._current, event, text)

    def publish_feedback(self, fields: Any) -> None:
        """Publish the feedback of the current goal."""
        if self._current is not None and self._feedback.connection_count:
            self._publish(
                self._feedback,
                f"{self._action}ActionFeedback",
                status=self._current.status,
                feedback=fields,
            )
            self._feedback_first.note_feedback()

    # -- messages ----------------------------------------------------------------

    def _on_goal(self, message: Any) -> None:
        self._add(message)
        self._notify()

    def _add(self, message: Any) -> None:
        with self._lock:
            now_ns, goal_id = self._now_ns(), message.goal_id
            known = self._goals.find(goal_id.id) if goal_id.id else None
            if known is not None:
                if known.status.status == Status.RECALLING:
                    self._end(known, GoalEvent.CANCEL, "")
                return
            is_late = 0 < in_ns(goal_id.stamp) <= self._last_cancel_ns
            if not goal_id.id:
                self._count += 1
                goal_id.id = f"{self._node.name}-{self._count}-{now_ns / 1e9:.9f}"
            if not in_ns(goal_id.stamp):
                goal_id.stamp = stamp(self._node.clock)
            goal = Goal(message.goal, _status(goal_id, Status.PENDING), self._epoch)
            if not self._goals.add(goal_id.id, goal):
                self._node.log.warning("a goal is rejected: there are too many goals, or its ID is too long")
                self._end(
                    goal,
                    GoalEvent.REJECT,
                    "this action server has too many goals, or the goal ID is too long",
                )
            elif is_late or any(_is_older(goal, other) for other in (self._current, self._next)):
                self._end(goal, GoalEvent.CANCEL, REPLACED)
            else:
                if self._next is not None:
                    self._end(self._next, GoalEvent.CANCEL, REPLACED)
                self._next, self._is_next_cancelled = goal, False

    def _on_cancel(self, message: Any) -> None:
        with self._lock:
            now_ns, stamp_ns = self._now_ns(), in_ns(message.stamp)
            for goal in self._goals.meant_by(message.id, stamp_ns, _stamp_of):
                if self._change(goal, GoalEvent.CANCEL_REQUESTED, goal.status.text):
                    self.is_cancelled |= goal is self._current
                    self._is_next_cancelled |= goal is self._next
            if message.id and self._goals.find(message.id) is None:
                expected = _status(message, Status.RECALLING)
                self._goals.add(message.id, Goal(None, expected, self._epoch, now_ns or 1))
            self._last_cancel_ns = max(self._last_cancel_ns, stamp_ns)
            self._publish_change()

    def _now_ns(self) -> int:
        """Return the time. If it has moved back, stamps from before no longer make new goals too late."""
        now_ns = self._node.clock.now_ns()
        if self._watch.has_gone_back(now_ns):
            self._epoch, self._last_cancel_ns = self._epoch + 1, 0
        return now_ns

    # -- statuses ----------------------------------------------------------------

    def _change(self, goal: Goal, event: GoalEvent, text: str) -> bool:
        status = after(goal.status.status, event)
        if status is None:
            return False
        goal.status = _status(goal.status.goal_id, status, text)
        if status in TERMINAL:
            goal.ended_ns = self._node.clock.now_ns() or 1
        return True

    def _end(self, goal: Goal | None, event: GoalEvent, text: str) -> None:
        if goal is not None and self._change(goal, event, text):
            self._feedback_first.wait()
            self._publish(self._results, f"{self._action}ActionResult", status=goal.status)
            self._publish_change()

    def _publish_change(self) -> None:
        if len(self._goals) <= STATUSES_AT_ONCE:
            self._publish_statuses()

    def _publish_statuses(self) -> None:
        with self._lock:
            now_ns = self._now_ns()
            self._goals.keep(lambda goal: not goal.ended_ns or elapsed(now_ns, goal.ended_ns) <= _KEPT_NS)
            listed = [goal.status for goal in self._goals]
            self._publish(self._statuses, "actionlib_msgs/GoalStatusArray", status_list=listed)

    def _publish(self, publisher: Any, kind: str, **fields: Any) -> None:
        publisher.publish(stamped(kind, "", stamp(self._node.clock), **fields))


def _status(goal_id: Any, status: Status, text: str = "") -> Any:
    return load_message_class("actionlib_msgs/GoalStatus")(goal_id, int(status), text)


def _stamp_of(goal: Goal) -> int:
    return in_ns(goal.status.goal_id.stamp)


def _is_older(goal: Goal, other: Goal | None) -> bool:
    return other is not None and other.epoch == goal.epoch and _stamp_of(goal) < _stamp_of(other)
