"""ROS 2 action definitions, and the services and messages derived from them.

See https://design.ros2.org/articles/actions.html.
"""

from __future__ import annotations

from dataclasses import dataclass

from pipros.basics.errors import NotFound
from pipros_rosbag2.interfaces.spec import TIME, Ros2Field, Ros2Message, Ros2Service, Ros2Type

CANCEL_GOAL = "action_msgs/srv/CancelGoal"
STATUS_ARRAY = "action_msgs/msg/GoalStatusArray"
_GOAL_ID = Ros2Field(Ros2Type("unique_identifier_msgs/msg/UUID"), "goal_id")


@dataclass(frozen=True, slots=True)
class Ros2Action:
    """An action definition. The parts have the types `package/action/Name_Goal`, `…_Result`, `…_Feedback`."""

    type: str
    goal: Ros2Message
    result: Ros2Message
    feedback: Ros2Message

    @property
    def send_goal(self) -> Ros2Service:
        return _service(
            f"{self.type}_SendGoal",
            (_GOAL_ID, _part("goal", self.goal)),
            (Ros2Field(Ros2Type("bool"), "accepted"), Ros2Field(Ros2Type(TIME), "stamp")),
        )

    @property
    def get_result(self) -> Ros2Service:
        return _service(
            f"{self.type}_GetResult",
            (_GOAL_ID,),
            (Ros2Field(Ros2Type("int8"), "status"), _part("result", self.result)),
        )

    @property
    def feedback_message(self) -> Ros2Message:
        return Ros2Message(f"{self.type}_FeedbackMessage", (_GOAL_ID, _part("feedback", self.feedback)))


def action_of_service(type_name: str) -> str:
    """Return the action for the type of its `send_goal` service.

    Raises:
        NotFound: the type is not that of an action's `send_goal` service.

    >>> action_of_service("example_interfaces/action/Fibonacci_SendGoal")
    'example_interfaces/action/Fibonacci'
    """
    name = type_name.removesuffix("_SendGoal")
    if name == type_name or "/action/" not in name:
        raise NotFound(f"{type_name} is not the type of an action's send_goal service")
    return name


def _part(name: str, message: Ros2Message) -> Ros2Field:
    return Ros2Field(Ros2Type(message.type), name)


def _service(name: str, request: tuple[Ros2Field, ...], response: tuple[Ros2Field, ...]) -> Ros2Service:
    return Ros2Service(
        name, Ros2Message(f"{name}_Request", request), Ros2Message(f"{name}_Response", response)
    )
