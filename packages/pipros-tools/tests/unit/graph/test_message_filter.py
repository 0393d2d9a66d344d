"""`--filter`: the messages that an expression selects, and the fields that it can read."""

import pytest

from pipros.msg import load_message_class
from pipros.msg.time import Time
from pipros_tools.graph.message_filter import MessageFilter

Pose = load_message_class("geometry_msgs/PoseStamped")


def pose(x: float) -> object:
    message = Pose()
    message.pose.position.x = x  # type: ignore[attr-defined]
    message.header.stamp = Time(3, 500_000_000)  # type: ignore[attr-defined]
    return message


@pytest.mark.parametrize(("expression", "selected"), [
    ("m.pose.position.x > 1", [2.0, 3.0]), ("m.pose.position.x in (1, 3)", [1.0, 3.0]),
    ("m.header.stamp.secs == 3 and topic == '/goal'", [1.0, 2.0, 3.0]),
    ("m.header.stamp.to_sec() > 3.4", [1.0, 2.0, 3.0]),
    ("m._type == 'geometry_msgs/PoseStamped'", [1.0, 2.0, 3.0]), ("False", []),
])  # fmt: skip
def test_an_expression_selects(expression: str, selected: list[float]) -> None:
    passes = MessageFilter(expression)

    assert [x for x in (1.0, 2.0, 3.0) if passes(pose(x), "/goal")] == selected


def test_each_reason_of_a_failure_is_reported_once() -> None:
    complaints: list[str] = []
    passes = MessageFilter("m.speed > 1", complain=complaints.append)

    assert [passes(pose(x), "/goal") for x in (1.0, 2.0)] == [False, False]
    assert len(complaints) == 1
    assert "has no field [speed]" in complaints[0]
