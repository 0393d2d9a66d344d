"""A message that takes long to encode, while subscribers connect and disconnect and other nodes call."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any, BinaryIO

import pytest

from pipros.msg import load_message_class
from pipros.net.rpc_client import RpcClient
from pipros.node import Node
from pipros.node.publisher import Publisher
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")


class Gate:
    """Blocks the encoding of messages until it is opened, and counts those that have begun."""

    def __init__(self) -> None:
        self.begun = 0
        self._is_open = threading.Event()

    def pass_through(self) -> None:
        self.begun += 1
        assert self._is_open.wait(60)

    def open(self) -> None:
        self._is_open.set()


@pytest.fixture
def gate() -> Iterator[Gate]:
    gate = Gate()
    yield gate
    gate.open()


def slow_class(gate: Gate) -> Any:
    """Return std_msgs/String as a class from a genuine generator whose encoder waits for the gate."""

    class Slow(String):  # type: ignore[misc]
        _to_buffers = None

        def serialize(self, file: BinaryIO) -> None:
            gate.pass_through()
            String.serialize(self, file)

    return Slow


def latched(talker: Node, message_class: Any) -> Publisher[Any]:
    publisher = talker.advertise("map", message_class, latch=True, queue_size=0)
    publisher.publish(message_class("latched"))  # without subscribers nothing is encoded
    return publisher


def assert_answers(node: Node, topic: str = "/map") -> None:
    with RpcClient(node.uri, timeout_s=10) as caller:
        assert caller.call("getName", "/me")[2] == node.name
        assert caller.call("requestTopic", "/me", topic, [["TCPROS"]])[0] == 1


def test_a_node_answers_while_it_encodes_a_latched_message(make_node: MakeNode, gate: Gate) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    latched(talker, slow_class(gate))
    inbox = Inbox()
    listener.subscribe("map", String, inbox)
    wait_until(lambda: gate.begun)
    assert_answers(talker)
    gate.open()
    assert [message.data for message in inbox.wait()] == ["latched"]


def test_a_latched_message_is_encoded_once_for_all_that_wait(make_node: MakeNode, gate: Gate) -> None:
    talker, listeners = make_node("talker"), [make_node(f"listener{number}") for number in range(3)]
    latched(talker, slow_class(gate))
    inboxes = [Inbox() for _ in listeners]
    subscribers = [
        listener.subscribe("map", String, inbox) for listener, inbox in zip(listeners, inboxes, strict=True)
    ]
    for subscriber in subscribers:
        wait_until_connected(subscriber)
    gate.open()
    for inbox in inboxes:
        assert [message.data for message in inbox.wait()] == ["latched"]
    assert gate.begun == 1


def test_a_node_answers_while_a_subscriber_joins_amid_a_publication(make_node: MakeNode, gate: Gate) -> None:
    talker, first, second = make_node("talker"), make_node("first"), make_node("second")
    inboxes = Inbox(), Inbox()
    publisher = talker.advertise("map", slow_class(gate), queue_size=0)
    first.subscribe("map", String, inboxes[0])
    wait_until_connected(publisher)
    publishing = threading.Thread(target=lambda: publisher.publish(slow_class(gate)("one")), daemon=True)
    publishing.start()
    wait_until(lambda: gate.begun)
    subscriber = second.subscribe("map", String, inboxes[1])
    wait_until(lambda: len(talker.connections) == 2)
    assert_answers(talker)
    gate.open()
    wait_until_connected(publisher, 2)
    wait_until_connected(subscriber)
    publisher.publish(slow_class(gate)("two"))
    for inbox in inboxes:
        assert [message.data for message in inbox.wait(2)] == ["one", "two"]
    publishing.join(10)


def test_messages_follow_the_latched_one_without_loss_or_repetition(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("map", String, latch=True, queue_size=0)
    publisher.publish(String("0"))
    is_over = threading.Event()

    def publish() -> None:
        number = 0
        while not is_over.is_set():
            number += 1
            publisher.publish(String(str(number)))

    publishing = threading.Thread(target=publish, daemon=True)
    publishing.start()
    try:
        for _ in range(20):
            inbox = Inbox()
            subscriber = listener.subscribe("map", String, inbox)
            numbers = [int(message.data) for message in inbox.wait(50)[:50]]
            assert numbers == list(range(numbers[0], numbers[0] + 50))
            subscriber.unregister()
    finally:
        is_over.set()
        publishing.join(10)


def test_a_subscriber_that_leaves_before_its_turn_leaves_nothing(make_node: MakeNode, gate: Gate) -> None:
    log, lines = listening_log()
    talker, staying, leaving = make_node("talker", log=log), make_node("staying"), make_node("leaving")
    publisher = latched(talker, slow_class(gate))
    inbox = Inbox()
    staying.subscribe("map", String, inbox)
    wait_until(lambda: gate.begun)
    leaving.subscribe("map", String, Inbox())
    wait_until(lambda: len(talker.connections) == 2)
    leaving.shutdown("the end")
    wait_until(lambda: publisher.statistics()["links_ended"] == 1)
    gate.open()
    inbox.wait()
    publisher.publish(slow_class(gate)("next"))
    assert [message.data for message in inbox.wait(2)] == ["latched", "next"]
    assert (gate.begun, publisher.connection_count) == (2, 1)
    assert not lines


def test_a_node_answers_while_a_subscriber_leaves_amid_a_publication(make_node: MakeNode, gate: Gate) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("map", slow_class(gate), queue_size=0)
    listener.subscribe("map", String, Inbox())
    wait_until_connected(publisher)
    publishing = threading.Thread(target=lambda: publisher.publish(slow_class(gate)("one")), daemon=True)
    publishing.start()
    wait_until(lambda: gate.begun)
    listener.shutdown("the end")
    wait_until(lambda: publisher.connection_count == 0)
    assert_answers(talker)
    gate.open()
    publishing.join(10)


def test_the_end_of_a_topic_closes_subscribers_that_still_wait(make_node: MakeNode, gate: Gate) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = latched(talker, slow_class(gate))
    subscriber = listener.subscribe("map", String, Inbox())
    wait_until(lambda: gate.begun)
    wait_until_connected(subscriber)
    publisher.unregister()
    wait_until(lambda: subscriber.connection_count == 0)
    wait_until(lambda: len(talker.connections) == 0)
