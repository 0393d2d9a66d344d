"""A ROS 2 action server, offered in ROS 1."""

from __future__ import annotations

import logging
import os
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.names import NAME_CHARACTERS
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.net.workers import Workers
from pipros.node import Node
from pipros_libraries.actions.goal_table import GoalTable
from pipros_libraries.actions.status import TERMINAL, Status
from pipros_ros2.action_messages import (
    NO_ID,
    TO_ROS1,
    GoalInfo,
    Ros2Status,
    cancel_request,
    id_in_ros1,
    id_in_ros2,
    is_accepted,
    parse_status_array,
    split_id,
    with_id,
)
from pipros_ros2.action_pair import ActionPair
from pipros_ros2.bridged_services import CALL_S
from pipros_ros2.bridged_topics import MARK
from pipros_ros2.counts import Counts
from pipros_ros2.interface import ROS2_CALLS, Durability, PartHashes, Ros2Engine, Sample, TopicQos
from pipros_rosbag2.names import action_names

STATUS_S: Final = 0.2
"""Interval between ROS 1 status messages, as in actionlib."""
ENDED_S: Final = 5.0
"""How long a goal's status is published after the goal has ended, as in actionlib."""
RESULT_S: Final = 60.0
"""Time after which the result of a goal that has not ended is requested again."""
RETRY_S: Final = 1.0
_CANCELLING: Final = 4
_QUEUE: Final = 100
_LOG = logging.getLogger("pipros_ros2")


@dataclass(slots=True)
class _Ros2Goal:
    """A goal from a ROS 1 node.

    Attributes:
        key: its ID in ROS 2.
        is_sent: whether the ROS 2 server has accepted the goal, so that it can be cancelled there.
        is_cancelled: whether a ROS 1 node has requested its cancellation.
    """

    id: str
    stamp: Time
    key: bytes
    status: Status = Status.PENDING
    text: str = ""
    ended_s: float = 0.0
    is_sent: bool = False
    is_cancelled: bool = False


class ActionToRos2:
    """A ROS 2 action offered in ROS 1, so that ROS 1 nodes can send goals to it. Thread-safe.

    A thread waits for the result of each goal. Goals beyond `ROS2_CALLS` are queued. Cancellations
    are queued, too; those beyond `Limits.goals` are dropped.

    Attributes:
        counts: the goals received from ROS 1, and the failures (goals, feedback and statuses that could not
            be forwarded).
    """

    def __init__(self, node: Node, engine: Ros2Engine, name: str, pair: ActionPair, identity: str) -> None:
        """Offer the ROS 2 action in ROS 1. Blocks until the master answers.

        Raises:
            PiprosError: the engine is closed, or the node already uses one of the action's topics with
                another type.
        """
        self.counts = Counts()
        self.pair = pair
        self.types = pair.plan.ros1_type, pair.plan.ros2_type
        self._node = node
        self._name = name
        self._lock = threading.Lock()
        self._goals: GoalTable[_Ros2Goal] = GoalTable(
            node.limits.goals, NAME_CHARACTERS, lambda goal: goal.status in TERMINAL
        )
        self._others: list[tuple[GoalInfo, Ros2Status]] = []
        self._publish_at_s = 0.0
        self._is_closed = threading.Event()
        self._executing = Workers("ROS 2 goals", ROS2_CALLS)
        self._cancelled_early: GoalTable[float] = GoalTable(
            node.limits.goals, NAME_CHARACTERS, lambda _: True
        )
        self._cancellations: set[GoalInfo] = set()
        self._cancelling = Workers("cancelled ROS 2 goals", _CANCELLING)
        self._goal_id, self._goal_status, self._statuses = (
            load_message_class(f"actionlib_msgs/{each}")
            for each in ("GoalID", "GoalStatus", "GoalStatusArray")
        )
        with ExitStack() as stack:
            self._connect(stack, engine, {MARK: identity})
            self._ends = stack.pop_all()

    def _connect(self, stack: ExitStack, engine: Ros2Engine, headers: dict[str, str]) -> None:
        pair, hashes, names = self.pair, self.pair.hashes, action_names(self._name)

        def caller(service: str, kind: str, type_hash: str, parts: tuple[str, str]) -> Any:
            made = engine.caller(service, kind, type_hash, PartHashes(*parts))
            stack.callback(made.close)
            return made

        def publisher(part: str, message_class: Any) -> Any:
            made = self._node.endpoints.advertise(
                f"{self._name}/{part}", message_class, queue_size=_QUEUE, latch=False, headers=headers
            )
            stack.callback(made.unregister)
            return made

        self._send = caller(names.send_goal, pair.send_goal, hashes.send_goal, hashes.send_goal_parts)
        self._cancel = caller(
            names.cancel_goal, pair.cancel_goal, hashes.cancel_goal, hashes.cancel_goal_parts
        )
        self._result = caller(names.get_result, pair.get_result, hashes.get_result, hashes.get_result_parts)
        self._result_out = publisher("result", pair.result)
        self._feedback_out = publisher("feedback", pair.feedback)
        self._status_out = publisher("status", self._statuses)
        latched = TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1)
        for topic, kind, type_hash, qos, callback in (
            (names.feedback, pair.feedback_message, hashes.feedback, TopicQos(), self._on_feedback),
            (names.status, pair.status, hashes.status, latched, self._on_status),
        ):
            stack.callback(engine.subscribe(topic, kind, type_hash, qos, callback).close)
        for part, message_class, on_message in (
            ("goal", pair.goal, self._on_goal),
            ("cancel", self._goal_id, self._on_cancel),
        ):
            subscriber = self._node.subscribe(
                f"{self._name}/{part}", message_class, on_message, queue_size=_QUEUE
            )
            stack.callback(subscriber.unregister)

    def update(self) -> None:
        """Publish the statuses, and remove goals that ended at least `ENDED_S` ago.

        Do nothing if this was done less than `STATUS_S` ago.
        """
        now_s = time.monotonic()
        with self._lock:
            if now_s < self._publish_at_s:
                return
            self._publish_at_s = now_s + STATUS_S
            self._goals.keep(lambda goal: not goal.ended_s or now_s - goal.ended_s < ENDED_S)
            self._cancelled_early.keep(lambda cancelled_s: now_s - cancelled_s < ENDED_S)
        self._publish_status()

    def close(self) -> None:
        """Stop offering the action in ROS 1. Unfinished goals are aborted there, but continue in ROS 2."""
        self._is_closed.set()
        with self._lock:
            goals = list(self._goals)
        for goal in goals:
            self._end(goal, Status.ABORTED, None, "the action server has disappeared")
        self._executing.close()
        self._cancelling.close()
        self._ends.close()

    # -- from ROS 1 ------------------------------------------------------------------------------

    def _on_goal(self, message: Any) -> None:
        goal_id = message.goal_id.id or id_in_ros1(os.urandom(16))
        stamp = message.goal_id.stamp or self._now()
        goal = _Ros2Goal(goal_id, stamp, id_in_ros2(goal_id))
        with self._lock:
            if self._goals.find(goal_id) is not None:
                return
            self.counts.passed += 1
            goal.is_cancelled = self._cancelled_early.find(goal_id) is not None
            is_added = self._goals.add(goal_id, goal)
        try:
            if not is_added:
                raise PiprosError("too many goals, or the ID is too long")
            self._executing.run(self._execute, goal, with_id(goal.key, self.pair.goal_to_cdr(message.goal)))
        except (PiprosError, RuntimeError) as error:  # RuntimeError: the system cannot start another thread
            self.counts.fail(f"{self._name}: {error}")
            self._end(goal, Status.REJECTED, None, str(error))

    def _on_cancel(self, message: Any) -> None:
        stamp_ns = message.stamp.to_nsec()
        with self._lock:
            meant = self._goals.meant_by(message.id, stamp_ns, lambda goal: goal.stamp.to_nsec())
            for goal in meant:
                goal.is_cancelled = True
            if message.id and self._goals.find(message.id) is None:
                self._cancelled_early.add(message.id, time.monotonic())
            is_one = bool(message.id) and not stamp_ns
            is_unsent = is_one and any(not goal.is_sent and not goal.ended_s for goal in meant)
        if not is_unsent:  # `_execute` cancels goals that have not been sent yet
            self._cancel_in_ros2(GoalInfo(id_in_ros2(message.id) if message.id else NO_ID, stamp_ns))

    def _cancel_in_ros2(self, goal: GoalInfo) -> None:
        """Request a cancellation in another thread, unless the same request is queued."""
        with self._lock:
            if goal in self._cancellations:
                return
            has_space = len(self._cancellations) < self._node.limits.goals
            if has_space:
                self._cancelling.run(self._request_cancel, goal)
                self._cancellations.add(goal)
        if not has_space:
            _LOG.warning("a cancellation for the action %s was dropped: too many are queued", self._name)

    def _request_cancel(self, goal: GoalInfo) -> None:
        with self._lock:
            self._cancellations.discard(goal)
        try:
            self._cancel.call(cancel_request(goal), CALL_S)
        except PiprosError as error:
            _LOG.warning("a goal of the action %s was not cancelled: %s", self._name, error)

    def _execute(self, goal: _Ros2Goal, request: bytes) -> None:
        with self._lock:
            has_ended, is_cancelled = bool(goal.ended_s), goal.is_cancelled
        if has_ended:
            return
        if is_cancelled:
            self._end(goal, Status.RECALLED, None, "the goal was cancelled before it was sent")
            return
        try:
            if not is_accepted(self._send.call(request, CALL_S)):
                self._end(goal, Status.REJECTED, None, "the action server has rejected the goal")
                return
            with self._lock:
                goal.is_sent = True
                is_cancelled = goal.is_cancelled
            if is_cancelled:
                self._cancel_in_ros2(GoalInfo(goal.key))
            while not self._is_closed.is_set() and not goal.ended_s:
                reply = self._await_result(with_id(goal.key, b""))
                if reply is not None:
                    status, result = self.pair.result_to_ros1(reply)
                    ended = TO_ROS1[status] if status.has_ended else Status.ABORTED
                    text = "" if status.has_ended else f"the action server replied with status {status.name}"
                    self._end(goal, ended, result, text)
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self._name}: {error}")
            self._end(goal, Status.ABORTED, None, str(error))
            is_unknown = not goal.is_sent and not self._is_closed.is_set()
            if is_unknown and self._cancel.is_available:  # the server may have accepted the goal
                self._cancel_in_ros2(GoalInfo(goal.key))

    def _await_result(self, request: bytes) -> bytes | None:
        """Return the `get_result` reply, or None if the request should be repeated.

        Raises:
            PiprosError: the action server has disappeared.
        """
        try:
            reply: bytes = self._result.call(request, RESULT_S)
            return reply
        except PiprosError:
            if not self._result.is_available:
                raise
        self._is_closed.wait(RETRY_S)
        return None

    def _end(self, goal: _Ros2Goal, status: Status, result: Any, text: str) -> None:
        """End a goal and publish its result, unless the goal has already ended."""
        message = self.pair.result(
            status=self._status_of(goal.id, goal.stamp, status, text),
            result=result or self.pair.empty_result(),
        )
        message.header.stamp = self._now()
        with self._lock:
            if goal.ended_s:
                return
            goal.status, goal.text, goal.ended_s = status, text, time.monotonic()
            self._result_out.publish(message)  # before the lock is released, because `close` checks `ended_s`
        self._publish_status()

    # -- from ROS 2 ----------------------------------------------------------------------------

    def _on_feedback(self, sample: Sample) -> None:
        try:
            key, cdr = split_id(sample.payload)
            feedback = self.pair.feedback_to_ros1(cdr)
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self._name}: feedback was dropped: {error}")
            return
        with self._lock:
            goal = self._find(key)
        status = (
            self._status_of(id_in_ros1(key), Time(), Status.ACTIVE)
            if goal is None
            else self._status_of(goal.id, goal.stamp, goal.status)
        )
        message = self.pair.feedback(status=status, feedback=feedback)
        message.header.stamp = self._now()
        self._feedback_out.publish(message)

    def _on_status(self, sample: Sample) -> None:
        try:
            rows = parse_status_array(sample.payload, self._node.limits.goals)
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self._name}: a status was dropped: {error}")
            return
        others = []
        with self._lock:
            for info, status in rows:
                goal = self._find(info.goal)
                if goal is None:
                    others.append((info, status))
                elif not goal.ended_s and not status.has_ended:  # a goal ends with its result
                    goal.status = TO_ROS1[status]
            self._others = others
        self._publish_status()

    def _find(self, key: bytes) -> _Ros2Goal | None:
        return next((goal for goal in self._goals if goal.key == key), None)

    def _publish_status(self) -> None:
        with self._lock:
            message: Any = self._statuses(
                status_list=[
                    *(self._status_of(each.id, each.stamp, each.status, each.text) for each in self._goals),
                    *(
                        self._status_of(id_in_ros1(info.goal), _time(info.stamp_ns), TO_ROS1[status])
                        for info, status in self._others
                    ),
                ]
            )
            message.header.stamp = self._now()
            self._status_out.publish(message)

    def _status_of(self, goal_id: str, stamp: Time, status: Status, text: str = "") -> Any:
        return self._goal_status(self._goal_id(stamp, goal_id), int(status), text)

    def _now(self) -> Time:
        return _time(self._node.clock.now_ns())


def _time(stamp_ns: int) -> Time:
    return Time(stamp_ns // 1_000_000_000, stamp_ns % 1_000_000_000)
