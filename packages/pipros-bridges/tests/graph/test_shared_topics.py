"""Topics of a bridge, with real nodes."""

import json
import re
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from pipros.basics.errors import InvalidName, LimitExceeded, PiprosError
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.service_server import HandlerError
from pipros_bridges.foxglove.handler import Rules
from pipros_bridges.rosapi import Allowed, RosApi
from pipros_bridges.rosbridge.globs import Globs
from pipros_bridges.shared_topics import SharedTopics, TopicMessage, WrongType
from tests.support.constants import Constants
from tests.support.foxglove import connected, serving
from tests.support.nodes import MakeNode
from tests.support.waiting import wait_until

String = load_message_class("std_msgs/String")


def subscribers_of(master: Master, topic: str) -> list[str]:
    return list(dict(master.registry.system_state()[1]).get(topic, []))


@pytest.fixture
def topics(make_node: MakeNode) -> SharedTopics:
    return SharedTopics(make_node("bridge"))


def text_of(message: TopicMessage) -> str:
    return message.body[4:].decode()


def test_all_clients_share_one_subscription_and_its_messages(
    topics: SharedTopics, make_node: MakeNode
) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    first: list[TopicMessage] = []
    second: list[TopicMessage] = []
    taken = [topics.take("chatter", None, first.append), topics.take("/chatter", None, second.append)]
    wait_until(lambda: publisher.connection_count == 1 and topics.counts() == {"/chatter": 2})

    wait_until(lambda: publisher.publish(String("hello")) or (first and second))
    assert text_of(first[-1]) == "hello"
    assert any(message in second for message in first)  # the same object
    assert (first[-1].header["type"], first[-1].header["callerid"]) == ("std_msgs/String", "/talker")
    assert topics.type_of("/chatter") == "std_msgs/String"

    taken[0].close()
    wait_until(lambda: topics.counts() == {"/chatter": 1})
    assert publisher.connection_count == 1
    taken[1].close()
    taken[1].close()
    wait_until(lambda: publisher.connection_count == 0)
    wait_until(lambda: not topics.counts())


def test_later_clients_get_the_last_message_of_each_latching_publisher(
    topics: SharedTopics, make_node: MakeNode
) -> None:
    for name in "ab":
        publisher = make_node(name).advertise("/map", String, latch=True)
        publisher.publish(String("old"))
        publisher.publish(String(name))
    first: list[str] = []
    topics.take("/map", "std_msgs/String", lambda message: first.append(text_of(message)))
    wait_until(lambda: sorted(first) == ["a", "b"])

    later: list[TopicMessage] = []
    topics.take("/map", None, later.append)
    wait_until(lambda: sorted(map(text_of, later)) == ["a", "b"])
    assert all(message.is_latched for message in later)


def test_a_client_of_another_type_gets_one_error_and_no_message(
    topics: SharedTopics, make_node: MakeNode
) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    messages: list[TopicMessage] = []
    wrong: list[TopicMessage] = []
    errors: list[PiprosError] = []
    topics.take("/chatter", "std_msgs/Int32", wrong.append, errors.append)
    topics.take("/chatter", "std_msgs/String", messages.append)
    wait_until(lambda: publisher.publish(String("x")) or len(messages) > 3)

    assert not wrong
    assert [str(error) for error in errors] == [
        "[/chatter]: /talker publishes [std_msgs/String] instead of [std_msgs/Int32]"
    ]
    assert isinstance(errors[0], WrongType)


def test_a_failing_client_does_not_harm_the_others(topics: SharedTopics, make_node: MakeNode) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    messages: list[TopicMessage] = []
    topics.take("/chatter", None, lambda _: 1 / 0)
    topics.take("/chatter", None, messages.append)
    wait_until(lambda: publisher.publish(String("x")) or len(messages) > 1)


def test_taking_returns_at_once_if_the_master_does_not(make_node: MakeNode, master: Master) -> None:
    node = make_node("bridge")
    topics = SharedTopics(node)
    is_held = threading.Event()
    ask = node.master.register_subscriber

    def hang(*args: str) -> list[str]:
        is_held.wait(20)
        return ask(*args)

    node.master.register_subscriber = hang  # type: ignore[method-assign]
    taken = topics.take("/chatter", None, list[TopicMessage]().append)
    taken.close()
    is_held.set()
    wait_until(lambda: not topics.counts())


def test_the_master_knows_the_type_that_a_client_expects(topics: SharedTopics, make_node: MakeNode) -> None:
    master = make_node("tool").master
    topics.take("/wanted", "std_msgs/String", list[TopicMessage]().append)
    wait_until(lambda: ["/wanted", "std_msgs/String"] in master.get_topic_types())


def test_the_type_of_a_silent_topic_is_known_by_the_master(topics: SharedTopics, make_node: MakeNode) -> None:
    make_node("talker").advertise("/chatter", String)
    assert topics.type_of("chatter") == "std_msgs/String"
    assert topics.type_of("nothing") is None


def test_the_number_of_topics_is_limited(make_node: MakeNode, constants: Constants) -> None:
    constants(BRIDGE_TOPICS=1)
    topics = SharedTopics(make_node("bridge"))
    ignore: Callable[[TopicMessage], object] = list[TopicMessage]().append
    topics.take("/a", None, ignore)
    topics.take("/a", None, ignore)
    with pytest.raises(LimitExceeded, match="the limit is 1"):
        topics.take("/b", None, ignore)
    with pytest.raises(InvalidName):
        topics.take("not a name", None, ignore)


def test_a_client_that_replaces_its_subscription_all_the_time_has_one_and_misses_nothing(
    topics: SharedTopics, make_node: MakeNode
) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    received: list[str] = []
    taken = topics.take("/chatter", None, lambda message: received.append(text_of(message)))
    wait_until(lambda: publisher.connection_count == 1)
    largest = 0
    for number in range(300):
        taken = topics.take(
            "/chatter", None, lambda message: received.append(text_of(message)), replaces=taken
        )
        largest = max(largest, topics.counts()["/chatter"])
        publisher.publish(String(str(number)))
    wait_until(lambda: "299" in received)
    assert set(map(str, range(300))) <= set(received)
    wait_until(lambda: topics.counts() == {"/chatter": 1})
    assert largest <= 4  # the old one until its end, one in use, one not yet, and the newest

    pending = topics.take("/chatter", None, received.append, replaces=taken)
    pending.close()  # whether it has begun or not
    wait_until(lambda: not topics.counts() and publisher.connection_count == 0)


def test_a_subscription_lasts_if_the_one_that_replaces_it_fails(
    topics: SharedTopics, make_node: MakeNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    publisher = make_node("talker").advertise("/chatter", String)
    received: list[str] = []
    taken = topics.take("/chatter", None, lambda message: received.append(text_of(message)))
    wait_until(lambda: publisher.connection_count == 1)

    is_tried = threading.Event()

    def fail(_: object) -> None:
        is_tried.set()
        raise LimitExceeded("too many")

    monkeypatch.setattr(topics, "_subscribe", fail)
    later = topics.take("/chatter", None, list[TopicMessage]().append, replaces=taken)
    assert is_tried.wait(20)
    wait_until(lambda: publisher.publish(String("still")) or received)
    assert topics.counts() == {"/chatter": 2}
    later.close()
    wait_until(lambda: not topics.counts())


# A whitelist that allows a parameter allows no other parameter, although a dictionary contains it.


STORED = {"b": 1, "c": {"d": 2}}
CHANGES: list[tuple[str, Any, str]] = [
    ("/a", {"b": 5}, "/a/b"), ("/a", {"c": {"d": 5}}, "/a/c/d"), ("/a", {"new": 5, "c/d": 5}, "/a/new"),
    ("/a", 5, "/a/b"), ("/a", None, "/a/b"), ("/x/y", 5, "/x"),
]  # fmt: skip
"""Changes of allowed parameters, and a parameter that each of them would change, too."""


@pytest.fixture
def node(make_node: MakeNode) -> Node:
    node = make_node("bridge")
    node.params.set("/a", STORED)
    node.params.set("/x", 1)
    return node


@pytest.mark.parametrize(("name", "value", "other"), CHANGES)
def test_rosapi_changes_no_parameter_that_the_globs_do_not_allow(
    node: Node, name: str, value: Any, other: str
) -> None:
    api = RosApi(node, Allowed(params=Globs(["/a", "/x/y", "/free/*"])))
    change = api.delete_param if value is None else partial(api.set_param, value=json.dumps(value))
    with pytest.raises(HandlerError, match=f"the globs do not allow the parameter {other}$"):
        change(name)
    assert (node.params.get("/a"), node.params.get("/x")) == (STORED, 1)
    api.set_param("/free/all", json.dumps({"b": {"c": 2}}))
    api.delete_param("/free/all/b")


def test_rosapi_shows_no_parameter_that_the_globs_do_not_allow(node: Node) -> None:
    def shown(*globs: str) -> Any:
        return json.loads(RosApi(node, Allowed(params=Globs(globs))).get_param("/a", "")["value"])

    assert (shown("/a"), shown("/a", "/a/b")) == ({"c": {}}, {"b": 1, "c": {}})
    assert shown("/a", "/a/*") == shown() == STORED


@pytest.mark.parametrize(("name", "value", "other"), CHANGES)
def test_foxglove_changes_no_parameter_that_the_whitelist_does_not_allow(
    node: Node, name: str, value: Any, other: str
) -> None:
    rules = Rules(parameters=(re.compile("/a|/x/y|/free.*"),), has_control=True)
    with serving(node, rules) as address, connected(address) as client:
        client.send("setParameters", parameters=[{"name": name, "value": value}])
        message = client.next("status", level=2)["message"]
        assert message.endswith(f"the whitelist does not allow the parameter {other}")
        client.send("setParameters", parameters=[{"name": "/free", "value": {"b": 2}}], id="set")
        assert client.next("parameterValues", id="set")
    assert (node.params.get("/a"), node.params.get("/x")) == (STORED, 1)
    assert node.params.get("/free") == {"b": 2}
