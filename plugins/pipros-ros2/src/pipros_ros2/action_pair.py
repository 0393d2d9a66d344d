"""A ROS 1 action and the corresponding ROS 2 action, with their message classes, services and topics."""

from __future__ import annotations

from typing import Any, Final

from pipros.msg import load_message_class
from pipros.node.codec import decoder, encoder
from pipros_ros2.action_messages import Ros2Status
from pipros_rosbag2.conversion.errors import ConversionError
from pipros_rosbag2.conversion.plans import ActionPlan, ConversionPlan
from pipros_rosbag2.interfaces.action_types import CANCEL_GOAL, STATUS_ARRAY
from pipros_rosbag2.interfaces.type_hash import ActionHashes


class ActionPair:
    """Converts the parts of an action between ROS 1 message objects and CDR.

    Attributes:
        plan, hashes: the conversion, and the ROS 2 type hashes.
        goal, result, feedback: message classes of the ROS 1 topics with these names.
        send_goal, get_result, cancel_goal, feedback_message, status: names of ROS 2 types.
    """

    cancel_goal: Final = CANCEL_GOAL
    status: Final = STATUS_ARRAY

    def __init__(self, plan: ActionPlan, hashes: ActionHashes) -> None:
        """Compile the conversions.

        Raises:
            PiprosError: the action is not installed in ROS 1, or its ROS 1 and ROS 2 types do not match.
        """
        self.plan = plan
        self.hashes = hashes
        for each in (plan.goal, plan.result, plan.feedback):
            each.prepare()
        self.goal, self.result, self.feedback = (
            self._class(f"Action{part}") for part in ("Goal", "Result", "Feedback")
        )
        self._goal, self._result, self._feedback = map(self._class, ("Goal", "Result", "Feedback"))
        self.send_goal = f"{plan.ros2_type}_SendGoal"
        self.get_result = f"{plan.ros2_type}_GetResult"
        self.feedback_message = f"{plan.ros2_type}_FeedbackMessage"

    def _class(self, suffix: str) -> Any:
        return load_message_class(self.plan.ros1_type + suffix)

    def goal_to_cdr(self, goal: Any) -> bytes:
        return _to_cdr(self.plan.goal, self._goal, goal)

    def goal_to_ros1(self, cdr: bytes) -> Any:
        return decoder(self._goal)(self.plan.goal.to_ros1(cdr))

    def feedback_to_cdr(self, feedback: Any) -> bytes:
        return _to_cdr(self.plan.feedback, self._feedback, feedback)

    def feedback_to_ros1(self, cdr: bytes) -> Any:
        return decoder(self._feedback)(self.plan.feedback.to_ros1(cdr))

    def result_to_cdr(self, status: Ros2Status, result: Any = None) -> bytes:
        """Return a `get_result` reply, with an empty result if `result` is None."""
        return _to_cdr(self.plan.result, self._result, result or self._result(), bytes([status]))

    def result_to_ros1(self, cdr: bytes) -> tuple[Ros2Status, Any]:
        """Return the status and the result in a `get_result` reply.

        Raises:
            ConversionError: the reply is malformed, or the status is unknown.
        """
        body = self.plan.result.to_ros1(cdr)
        if body[0] not in Ros2Status._value2member_map_:
            raise ConversionError(f"unknown goal status {body[0]}")
        return Ros2Status(body[0]), decoder(self._result)(body[1:])

    def empty_result(self) -> Any:
        return self._result()


def _to_cdr(plan: ConversionPlan, message_class: Any, message: Any, start: bytes = b"") -> bytes:
    return plan.to_cdr(b"".join((start, *encoder(message_class)(message))))
