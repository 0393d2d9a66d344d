"""A relay stops a robot whose driver has gone: a browser, a client of a bridge, an assistant."""

from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.velocities import VELOCITIES, RelayedVelocity, speeds
from pipros_libraries.topic_tools.raw import class_like
from pipros_server.act_gate import ActGate
from tests.support.nodes import Inbox
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


def moving(kind: str) -> Any:
    message: Any = load_message_class(kind)()
    inner = getattr(message, "twist", getattr(message, "drive", message))
    if hasattr(inner, "speed"):
        inner.speed = 0.5
    else:
        inner.linear.x = 0.5
    return message


class Recorded:
    """A publisher that keeps messages."""

    def __init__(self, message_class: Any) -> None:
        self.messages: list[Any] = []
        self.publication, self.message_class, self.publish = self, message_class, self.messages.append


@pytest.mark.parametrize("kind", VELOCITIES)
@pytest.mark.parametrize("is_raw", [False, True])
def test_the_last_velocity_of_a_source_that_has_gone_is_zero(kind: str, is_raw: bool) -> None:
    found: Any = load_message_class(kind)
    taken: Any = class_like({"type": kind, "md5sum": found._md5sum}) if is_raw else found
    publisher: Any = Recorded(taken)
    relayed = RelayedVelocity(Node("server"), publisher)
    relayed.end()
    for message in (moving(kind), found()):
        relayed.note(taken(b"".join(message._to_buffers())) if is_raw else message)
    relayed.end()
    assert publisher.messages == [], "the source has stopped the base itself"
    relayed.note(taken(b"".join(moving(kind)._to_buffers())) if is_raw else moving(kind))
    relayed.end()
    relayed.end()
    assert [b"".join(each._to_buffers()) for each in publisher.messages] == [b"".join(found()._to_buffers())]


def test_other_types_and_damaged_velocities_are_left_alone() -> None:
    text: Any = load_message_class("std_msgs/String")
    kind: Any = class_like({"type": VELOCITIES[0], "md5sum": "0" * 32})
    for message_class, message in ((text, text("x")), (kind, kind(b"short"))):
        publisher: Any = Recorded(message_class)
        relayed = RelayedVelocity(Node("server"), publisher)
        relayed.note(message)
        relayed.end()
        assert publisher.messages == []


def test_a_client_that_withdraws_its_publisher_stops_the_robot(ros: RosSystem) -> None:
    ros.serve_master()
    twist: Any = load_message_class(VELOCITIES[0])
    with ros.node("server") as node:
        inbox = Inbox.of(node, "/cmd_vel", twist)
        client: Any = ActGate(node).advertise("/cmd_vel", twist)
        wait_until(lambda: client.connection_count)
        client.publish(moving(VELOCITIES[0]))
        client.unregister()
        wait_until(lambda: inbox.messages == [moving(VELOCITIES[0]), twist()])


@pytest.mark.parametrize("kind", VELOCITIES)
def test_a_server_that_ends_or_is_suspended_stops_the_robot_of_its_client(ros: RosSystem, kind: str) -> None:
    ros.serve_master()
    found: Any = load_message_class(kind)
    with ros.node("robot") as robot:
        inbox = Inbox.of(robot, "/cmd_vel", found)
        are_moving = lambda: [any(speeds(each)) for each in inbox.messages]  # noqa: E731
        with ros.node("server") as node:
            publisher = node.advertise("/cmd_vel", found, queue_size=1)
            relayed = RelayedVelocity(node, publisher)
            wait_until(lambda: publisher.connection_count)
            for _ in range(2):
                relayed.note(moving(kind))
                publisher.publish(moving(kind))
            with relayed.suspended():
                wait_until(lambda: are_moving() == [True, True, False])
            relayed.note(moving(kind))
            publisher.publish(moving(kind))
        wait_until(lambda: are_moving() == [True, True, False, True, False])
