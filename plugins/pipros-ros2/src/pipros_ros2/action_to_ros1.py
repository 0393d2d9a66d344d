"""A ROS 1 action server, offered in ROS 2."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.names import NAME_CHARACTERS
from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros.node import Node
from pipros_libraries.actions.goal_table import GoalTable
from pipros_libraries.actions.status import Status
from pipros_ros2.action_messages import (
    NO_ID,
    TO_ROS2,
    CancelCode,
    GoalInfo,
    Ros2Status,
    accepted_reply,
    cancel_reply,
    id_in_ros1,
    id_in_ros2,
    parse_cancel_request,
    split_id,
    status_array,
    with_id,
)
from pipros_ros2.action_pair import ActionPair
from pipros_ros2.bridged_services import CALL_S
from pipros_ros2.bridged_topics import MARK
from pipros_ros2.counts import Counts
from pipros_ros2.interface import ROS2_HISTORY_BYTES, Durability, PartHashes, Ros2Engine, TopicQos
from pipros_rosbag2.names import action_names

KEPT_S: Final = 60.0
"""How long a goal's result can be requested after the goal has ended."""
DECISION_S: Final = 0.5
"""Time that a server has to reject a goal that it has received. Afterwards, the goal counts as accepted."""
_LATE_RESULT_S: Final = 5.0
"""How long to wait for the result after the status reported the end of the goal."""
_SLICE_S: Final = 0.5
_QUEUE: Final = 100


@dataclass(slots=True)
class _Ros1Goal:
    """A goal for the server.

    Attributes:
        id: its ID in ROS 1.
        status: None until the server has reported it.
        results: the `get_result` reply for each type of the action, or empty.
    """

    id: str
    key: bytes
    stamp_ns: int
    status: Ros2Status | None = None
    is_rejected: bool = False
    results: tuple[bytes, ...] = ()
    ended_s: float = 0.0

    @property
    def has_ended(self) -> bool:
        return self.ended_s > 0

    @property
    def result_bytes(self) -> int:
        return sum(map(len, self.results))


class ActionToRos1:
    """Offers a ROS 1 action in ROS 2, so that ROS 2 nodes can send goals to it. Thread-safe.

    If several ROS 2 types correspond to the action, it is offered with each of them. The types share one
    cancellation service and one status topic, whose types are the same for all actions.

    Attributes:
        counts: the goals received from ROS 2, and the failures (goals that the gateway refused or to which
            the server did not respond, and results, feedback and statuses that could not be forwarded).
    """

    def __init__(
        self, node: Node, engine: Ros2Engine, name: str, pairs: Sequence[ActionPair], identity: str
    ) -> None:
        """Offer the ROS 1 action in ROS 2. Blocks until the master answers.

        Args:
            pairs: at least one, all with the same ROS 1 type.

        Raises:
            PiprosError: the engine is closed, the name is not legal in ROS 2, or the node already uses one of
                the action's topics with another type.
        """
        self.counts = Counts()
        self._pairs = pairs
        self.types = pairs[0].plan.ros1_type, ", ".join(each.plan.ros2_type for each in pairs)
        self._node = node
        self._name = name
        self._changed = threading.Condition()
        self._is_closed = False
        self._goals: GoalTable[_Ros1Goal] = GoalTable(
            node.limits.goals, NAME_CHARACTERS, lambda goal: goal.has_ended
        )
        self._goal_id = load_message_class("actionlib_msgs/GoalID")
        with ExitStack() as stack:
            self._connect(stack, engine, {MARK: identity})
            self._ends = stack.pop_all()

    def _connect(self, stack: ExitStack, engine: Ros2Engine, headers: dict[str, str]) -> None:
        node, pair, names = self._node, self._pairs[0], action_names(self._name)
        hashes = pair.hashes

        def publisher(part: str, message_class: Any) -> Any:
            made = node.endpoints.advertise(
                f"{self._name}/{part}", message_class, queue_size=_QUEUE, latch=False, headers=headers
            )
            stack.callback(made.unregister)
            return made

        self._goal_out = publisher("goal", pair.goal)
        self._cancel_out = publisher("cancel", self._goal_id)
        latched = TopicQos(durability=Durability.TRANSIENT_LOCAL, depth=1)
        self._status_out = engine.advertise(names.status, pair.status, hashes.status, latched)
        stack.callback(self._status_out.close)
        self._feedback_out = []
        for each in self._pairs:
            out = engine.advertise(names.feedback, each.feedback_message, each.hashes.feedback, TopicQos())
            stack.callback(out.close)
            self._feedback_out.append(out)
        self._subscribers = []
        for part, message_class, on_message in (
            ("result", pair.result, self._on_result),
            ("feedback", pair.feedback, self._on_feedback),
            ("status", load_message_class("actionlib_msgs/GoalStatusArray"), self._on_status),
        ):
            subscriber = node.subscribe(f"{self._name}/{part}", message_class, on_message, queue_size=_QUEUE)
            stack.callback(subscriber.unregister)
            self._subscribers.append(subscriber)

        def serve(
            service: str, kind: str, type_hash: str, answer: Callable[[bytes], bytes], parts: tuple[str, str]
        ) -> None:
            stack.callback(engine.serve(service, kind, type_hash, answer, PartHashes(*parts)).close)

        cancel_parts = hashes.cancel_goal_parts
        serve(names.cancel_goal, pair.cancel_goal, hashes.cancel_goal, self._cancel, cancel_parts)
        for index, each in enumerate(self._pairs):
            of = each.hashes
            result = partial(self._get_result, index)
            serve(names.get_result, each.get_result, of.get_result, result, of.get_result_parts)
        for each in self._pairs:
            of = each.hashes
            goal = partial(self._send_goal, each)
            serve(names.send_goal, each.send_goal, of.send_goal, goal, of.send_goal_parts)

    def update(self) -> None:
        """Remove goals that ended more than `KEPT_S` ago."""
        now_s = time.monotonic()
        with self._changed:
            self._goals.keep(lambda goal: not goal.has_ended or now_s - goal.ended_s <= KEPT_S)

    def close(self) -> None:
        """Stop offering the action in ROS 2. Unfinished goals continue in ROS 1."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        self._ends.close()

    # -- from ROS 2, in the engine's threads -----------------------------------------------------

    def _send_goal(self, pair: ActionPair, request: bytes) -> bytes:
        key, cdr = split_id(request)
        goal = _Ros1Goal(id_in_ros1(key), key, self._node.clock.now_ns())
        message = pair.goal(goal=pair.goal_to_ros1(cdr))
        stamp = Time(goal.stamp_ns // 1_000_000_000, goal.stamp_ns % 1_000_000_000)
        message.header.stamp = stamp
        message.goal_id = self._goal_id(stamp, goal.id)
        end_s = time.monotonic() + CALL_S
        with self._changed:
            self.counts.passed += 1
            if self._goals.find(goal.id) is not None or not self._goals.add(goal.id, goal):
                self.counts.fail(f"{self._name}: too many goals, or a repeated ID")
                return accepted_reply(goal.stamp_ns, is_accepted=False)
        if self._wait(lambda: self._is_connected, end_s):
            self._goal_out.publish(message)
            self._wait(lambda: goal.status is not None, end_s)
            decided_s = min(end_s, time.monotonic() + DECISION_S)
            self._wait(lambda: goal.status is not Ros2Status.ACCEPTED, decided_s)
        with self._changed:
            is_accepted = goal.status is not None and not goal.is_rejected
            if not is_accepted:
                self._forget(goal)
            if goal.status is None:
                self.counts.fail(f"{self._name}: the server did not respond to a goal within {CALL_S:g} s")
        if goal.status is None:
            self._cancel_out.publish(message.goal_id)
        return accepted_reply(goal.stamp_ns, is_accepted=is_accepted)

    @property
    def _is_connected(self) -> bool:
        """Whether the ROS 1 server is connected in both directions."""
        return all(each.connection_count for each in (self._goal_out, self._cancel_out, *self._subscribers))

    def _get_result(self, index: int, request: bytes) -> bytes:
        """Wait until a goal ends, and return the `get_result` reply of the type at `index`."""
        pair = self._pairs[index]
        key, _ = split_id(request)
        with self._changed:
            goal = self._goals.find(id_in_ros1(key))
        if goal is None:
            return pair.result_to_cdr(Ros2Status.UNKNOWN)

        def is_complete() -> bool:
            is_late = time.monotonic() - goal.ended_s > _LATE_RESULT_S
            return goal.has_ended and (bool(goal.results) or is_late)

        while not self._wait(is_complete, time.monotonic() + KEPT_S):
            if self._is_closed:
                raise PiprosError(f"the action {self._name} was closed")
        results = goal.results
        return results[index] if results else pair.result_to_cdr(goal.status or Ros2Status.ABORTED)

    def _cancel(self, request: bytes) -> bytes:
        info = parse_cancel_request(request)
        with self._changed:
            found = None if info.goal == NO_ID else self._goals.find(id_in_ros1(info.goal))
            table_id = "" if info.goal == NO_ID else id_in_ros1(info.goal)
            meant = self._goals.meant_by(table_id, info.stamp_ns, lambda goal: goal.stamp_ns)
            running = [GoalInfo(goal.key, goal.stamp_ns) for goal in meant if not goal.has_ended]
        if info.goal != NO_ID and found is None:
            return cancel_reply(CancelCode.UNKNOWN_GOAL, [])
        if found is not None and not running:
            return cancel_reply(CancelCode.GOAL_TERMINATED, [])
        stamp = Time(info.stamp_ns // 1_000_000_000, info.stamp_ns % 1_000_000_000)
        self._cancel_out.publish(self._goal_id(stamp, found.id if found else ""))
        return cancel_reply(CancelCode.NONE, running)

    def _wait(self, condition: Callable[[], bool], end_s: float) -> bool:
        """Wait until the condition holds; return False if the time expires or the action is closed first."""
        with self._changed:
            while not condition():
                left_s = end_s - time.monotonic()
                if left_s <= 0 or self._is_closed:
                    return False
                self._changed.wait(min(left_s, _SLICE_S if self._is_connected else _SLICE_S / 10))
            return True

    # -- from ROS 1 ------------------------------------------------------------------------------

    def _on_status(self, message: Any) -> None:
        seen = set()
        with self._changed:
            before = self._rows()
            for row in message.status_list[: self._node.limits.goals]:
                goal = self._found(row.goal_id)
                if goal is not None:
                    seen.add(goal.key)
                    self._set_status(goal, row.status)
            for goal in self._goals:
                if goal.status is not None and not goal.has_ended and goal.key not in seen:
                    goal.status, goal.ended_s = Ros2Status.ABORTED, time.monotonic()
            self._notify(before)

    def _on_result(self, message: Any) -> None:
        with self._changed:
            before = self._rows()
            goal = self._found(message.status.goal_id)
            if goal is None:
                return
            self._set_status(goal, message.status.status)
            if goal.status is not None and not goal.results:
                status = goal.status
                goal.results = tuple(self._result_of(each, status, message.result) for each in self._pairs)
                self._limit_results()
            self._notify(before)

    def _limit_results(self) -> None:
        """Remove the oldest goals with results until the remaining results are within the limit."""
        excess = sum(goal.result_bytes for goal in self._goals) - ROS2_HISTORY_BYTES
        for goal in self._goals:
            if excess <= 0:
                return
            if goal.results:
                excess -= goal.result_bytes
                self._forget(goal)

    def _result_of(self, pair: ActionPair, status: Ros2Status, result: Any) -> bytes:
        try:
            return pair.result_to_cdr(status, result)
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self._name}: a result was dropped: {error}")
            return pair.result_to_cdr(Ros2Status.ABORTED)

    def _on_feedback(self, message: Any) -> None:
        key = id_in_ros2(message.status.goal_id.id)
        try:
            for pair, out in zip(self._pairs, self._feedback_out, strict=True):
                out.publish(with_id(key, pair.feedback_to_cdr(message.feedback)))
        except (PiprosError, ValueError) as error:
            self.counts.fail(f"{self._name}: feedback was dropped: {error}")

    def _found(self, goal_id: Any) -> _Ros1Goal | None:
        """Return the goal with a ROS 1 ID, adding it if it is unknown; None if there are too many goals."""
        key = id_in_ros2(goal_id.id)
        goal = self._goals.find(id_in_ros1(key))
        if goal is None:
            goal = _Ros1Goal(goal_id.id, key, goal_id.stamp.to_nsec())
            if not self._goals.add(id_in_ros1(key), goal):
                return None
        return goal

    def _set_status(self, goal: _Ros1Goal, status: int) -> None:
        if goal.has_ended or status not in Status._value2member_map_:
            return
        goal.is_rejected |= status == Status.REJECTED
        goal.status = TO_ROS2[Status(status)]
        if goal.status.has_ended:
            goal.ended_s = time.monotonic()

    def _forget(self, goal: _Ros1Goal) -> None:
        self._goals.keep(lambda each: each is not goal)

    def _rows(self) -> list[tuple[GoalInfo, Ros2Status]]:
        return [
            (GoalInfo(goal.key, goal.stamp_ns), goal.status)
            for goal in self._goals
            if goal.status is not None and not goal.is_rejected
        ]

    def _notify(self, before: list[tuple[GoalInfo, Ros2Status]]) -> None:
        """Wake waiting threads, and publish the statuses if they have changed."""
        self._changed.notify_all()
        now = self._rows()
        if now != before:
            try:
                self._status_out.publish(status_array(now))
            except PiprosError as error:
                self.counts.fail(f"{self._name}: a status was dropped: {error}")
