"""Topics between the members of a fleet: each has its own master, and all share a router."""

import itertools
import json
import logging
import threading
from contextlib import closing
from io import BytesIO
from itertools import count
from typing import Any

import pytest

from pipros.basics.budget import Budget
from pipros.basics.env import Environment
from pipros.basics.limits import process_limits
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.open_calls import OpenCalls
from pipros.node.service_client import ServiceClient
from pipros.node.service_link import ErrorReply, ServiceFailed
from pipros_fleet import keys
from pipros_fleet.agent import NameTaken, new_instance
from pipros_fleet.directory import Directory, DirectoryEntry, to_json
from pipros_fleet.messages import MessageAttachment, pack
from pipros_fleet.sinks import Sink, SinkRoom
from pipros_fleet.statistics import Statistics
from pipros_fleet.zenoh_session import LinkFailed, SessionLink, ZenohQuestion
from tests.support.fleet import LIMIT_S, Member, String, link_to
from tests.support.waiting import wait_until

ACCEPTS = "accept: {topics: [{name: /cmd, from: [operator]}]}"


def publish_until(publisher: Any, received: list[Any], text: str) -> None:
    """Publish numbered messages until one is received."""
    numbers = itertools.count()

    def arrives() -> bool:
        publisher.publish(String(f"{text} {next(numbers)}"))
        return any(message.data.startswith(text) for message in received)

    wait_until(arrives, LIMIT_S, f"{text} to arrive")


def test_a_topic_appears_below_the_members_name(robot: Member, operator: Member) -> None:
    talker = robot.node("talker").advertise("/chatter", String)
    operator.wait_for_topic("/robot1/chatter")
    received = operator.receive("/robot1/chatter")
    publish_until(talker, received, "hello")
    assert received[0]._connection_header["type"] == "std_msgs/String"
    assert "string data" in received[0]._connection_header["message_definition"]
    assert robot.state().publishers.keys() >= {"/chatter"}
    assert not any(topic.startswith("/operator/robot1") for topic in robot.state().publishers)


def test_a_directory_is_requested_again_from_a_member_that_does_not_answer(
    router: str, operator: Member
) -> None:
    with closing(link_to(router)) as busy:
        instance = new_instance()
        directory = Directory(
            "busy", instance, 1, (DirectoryEntry("/chatter", "std_msgs/String", String._md5sum),)
        )
        asked = itertools.count()

        def answer(question: Any) -> None:
            if next(asked) >= 2:
                question.answer(to_json(directory))
            question.close()

        held = [
            busy.serve(keys.directory("busy"), answer),
            busy.declare_token(keys.live("busy", keys.VERSION, instance)),
        ]
        operator.wait_for_topic("/busy/chatter")
        del held


def test_nothing_crosses_without_a_subscriber(robot: Member, operator: Member) -> None:
    talker = robot.node("talker").advertise("/chatter", String)
    operator.wait_for_topic("/robot1/chatter")
    for number in range(10):
        talker.publish(String(str(number)))
    assert (robot.agent.statistics()["sent"], talker.connection_count) == ({}, 0)

    listener = operator.node("listener")
    received: list[Any] = []
    subscriber = listener.subscribe("/robot1/chatter", String, received.append)
    publish_until(talker, received, "now")
    subscriber.unregister()
    wait_until(lambda: talker.connection_count == 0, LIMIT_S, "the agent to unsubscribe")


def test_a_late_subscriber_gets_the_latched_message_of_each_publisher(
    router: str, robot: Member, operator: Member
) -> None:
    for name in ("one", "two"):
        robot.node(name).advertise("/map", String, latch=True).publish(String(name))
    operator.wait_for_topic("/robot1/map")
    received = operator.receive("/robot1/map", name="first")
    wait_until(lambda: {each.data for each in received} == {"one", "two"}, LIMIT_S, "both maps")

    later = operator.receive("/robot1/map", name="second")
    wait_until(lambda: {each.data for each in later} == {"one", "two"}, LIMIT_S, "both maps again")
    assert later[0]._connection_header["latching"] == "1"

    with Member("other", router) as other:
        other.wait_for_topic("/robot1/map")
        elsewhere = other.receive("/robot1/map")
        wait_until(lambda: {each.data for each in elsewhere} == {"one", "two"}, LIMIT_S, "both elsewhere")


def test_the_status_of_an_action_is_received_after_its_outcome_topics_are_linked(router: str) -> None:
    types = {
        "status": load_message_class("actionlib_msgs/GoalStatusArray"),
        "feedback": load_message_class("actionlib/TestActionFeedback"),
        "result": load_message_class("actionlib/TestActionResult"),
    }
    with Member("robot1", router) as robot, Member("operator", router) as operator:
        server = robot.node("server")
        topics = {name: server.advertise(f"/do/{name}", kind) for name, kind in types.items()}
        for name in types:
            operator.wait_for_topic(f"/robot1/do/{name}")
        received: list[Any] = []
        client = operator.node("client")
        subscriber = client.subscribe("/robot1/do/status", types["status"], received.append)

        def arrives() -> bool:
            topics["status"].publish(types["status"]())
            return bool(received)

        wait_until(arrives, LIMIT_S, "the status")
        assert topics["feedback"].connection_count == topics["result"].connection_count == 1
        subscriber.unregister()
        wait_until(lambda: topics["result"].connection_count == 0, LIMIT_S, "the agent to unsubscribe")


def test_inputs_reach_a_robot_only_if_its_file_accepts_them(router: str) -> None:
    with (
        Member("robot1", router, ACCEPTS) as robot,
        Member("operator", router) as operator,
        Member("stranger", router) as stranger,
    ):
        commands = robot.receive("/cmd", name="base")
        robot.receive("/private", name="arm")
        operator.wait_for_input("/robot1/cmd")
        publisher = operator.node("teleop").advertise("/robot1/cmd", String)
        publish_until(publisher, commands, "go")
        assert "/robot1/private" not in operator.state().subscribers

        stranger.wait_for_input("/robot1/cmd")
        wrong = stranger.node("teleop").advertise("/robot1/cmd", String)
        wait_until(lambda: wrong.connection_count, LIMIT_S, "a connection")
        wrong.publish(String("stray"))
        operator_last = operator.node("again").advertise("/robot1/cmd", String)
        publish_until(operator_last, commands, "last")
        assert not [each for each in commands if each.data.startswith("stray")]


def test_messages_never_loop(router: str) -> None:
    """Two members share and accept a topic with the same name, and a third one shows both."""
    file = "accept: {topics: [/**]}"
    with Member("a", router, file) as a, Member("b", router, file) as b, Member("c", router, file) as c:
        at_a, at_b = a.receive("/x"), b.receive("/x")
        a.wait_for_input("/b/x")
        publisher = a.node("talker").advertise("/x", String)
        into_b = a.node("sender").advertise("/b/x", String)
        b.wait_for_topic("/a/x")
        at_c = c.receive("/a/x")
        publish_until(publisher, at_c, "plain")
        publish_until(into_b, at_b, "into b")
        texts = [each.data for each in (*at_a, *at_b, *at_c)]
        for member, received in (("a", at_a), ("b", at_b), ("c", at_c)):
            found = [each.data for each in received]
            assert len(found) == len(set(found)), f"{member} got a message twice: {texts}"
        assert not [each for each in at_a if each.data.startswith("into b")]
        names = {*a.state().publishers, *b.state().publishers, *c.state().publishers}
        assert not [name for name in names if name.count("/") > 2], names


def test_a_second_member_of_one_name_is_refused(router: str) -> None:
    with Member("robot1", router) as first, Member("operator", router) as operator:
        wait_until(lambda: "robot1" in operator.agent.statistics()["members"], LIMIT_S, "the first one")
        with pytest.raises(NameTaken, match=r"already has a member \[robot1\]"):
            Member("robot1", router)
    assert first.failures == []


def test_a_local_node_in_the_namespace_of_a_member_hides_it(router: str, operator: Member) -> None:
    blocking = operator.node("robot1_proxy")
    blocking.serve("/robot1/reset", load_empty(), lambda _: None)
    operator.wait_for_service("/robot1/reset")
    wait_until(lambda: operator.agent.local_names() >= {"/robot1/reset"}, LIMIT_S, "a look at the master")
    with Member("robot1", router) as robot:
        robot.node("talker").advertise("/chatter", String)
        expected = "[robot1] is not shown, because the local name [/robot1/reset] uses its namespace"
        wait_until(lambda: expected in operator.warnings, LIMIT_S, expected)
        assert "/robot1/chatter" not in operator.state().publishers


def load_empty() -> Any:
    from pipros.msg import load_service_class

    return load_service_class("std_srvs/Empty")


def test_topics_of_a_member_that_leaves_disappear(router: str, operator: Member) -> None:
    with Member("robot1", router) as robot:
        robot.node("talker").advertise("/chatter", String)
        operator.wait_for_topic("/robot1/chatter")
    wait_until(lambda: "/robot1/chatter" not in operator.state().publishers, LIMIT_S, "the topic to go")


def test_transforms_get_prefixes_and_static_ones_are_merged(router: str) -> None:
    message_class: Any = load_message_class("tf2_msgs/TFMessage")
    stamped: Any = load_message_class("geometry_msgs/TransformStamped")

    def transform(parent: str, child: str) -> Any:
        found = stamped()
        found.header.frame_id, found.child_frame_id = parent, child
        return message_class([found])

    file = "share: {topics: [{name: /tf_static, prefix_frames: true}]}"
    with Member("robot1", router, file) as robot, Member("operator", router) as operator:
        for name in ("laser", "camera"):
            publisher = robot.node(name).advertise("/tf_static", message_class, latch=True)
            publisher.publish(transform("base", name))
        operator.wait_for_topic("/robot1/tf_static")
        received = operator.receive("/robot1/tf_static", message_class)

        def children() -> set[str]:
            return {each.child_frame_id for each in received[-1].transforms} if received else set()

        wait_until(lambda: children() == {"robot1/laser", "robot1/camera"}, LIMIT_S, "the merged message")
        assert received[-1].transforms[0].header.frame_id == "robot1/base"


def test_a_rate_limit_keeps_the_last_message(router: str) -> None:
    file = "share: {topics: [{name: /state, rate_hz: 5, compress: true}]}"
    with Member("robot1", router, file) as robot, Member("operator", router) as operator:
        publisher = robot.node("talker").advertise("/state", String)
        operator.wait_for_topic("/robot1/state")
        received = operator.receive("/robot1/state")
        publish_until(publisher, received, "first")
        for number in range(100):
            publisher.publish(String(f"burst {number}"))
        wait_until(lambda: received[-1].data == "burst 99", LIMIT_S, "the last message")
        burst = [each.data for each in received if each.data.startswith("burst")]
        assert len(burst) < 100
        (counts,) = robot.agent.statistics()["sent"].values()
        assert counts[2] > 0, "what was dropped is counted"


def test_messages_dropped_before_the_link_are_counted(router: str) -> None:
    file = "share: {topics: [{name: /**, latest_only: true}]}"
    with Member("robot1", router, file) as robot, Member("operator", router) as operator:
        talker = robot.node("talker").advertise("/chatter", String)
        operator.wait_for_topic("/robot1/chatter")
        received = operator.receive("/robot1/chatter")
        publish_until(talker, received, "first")
        for number in range(2000):
            talker.publish(String(str(number)))

        def counted() -> int:
            return sum(
                messages + dropped + unsent
                for messages, _, dropped, unsent in robot.agent.statistics()["sent"].values()
            )

        wait_until(lambda: received[-1].data == "1999", LIMIT_S, "the newest message")
        wait_until(
            lambda: counted() == talker.statistics()["frames"], LIMIT_S, "all messages in the counters"
        )


def test_links_and_members_are_on_diagnostics(router: str) -> None:
    array: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
    with Member("operator", router) as operator, Member("robot1", router):
        received = operator.receive("/diagnostics", array)

        def names() -> set[str]:
            return {status.name for status in received[-1].status} if received else set()

        wait_until(
            lambda: names() == {"/Fleet/operator", "/Fleet/operator/robot1"}, LIMIT_S, "both components"
        )
        assert {status.message for status in received[-1].status} == {"connected", "present"}


def test_the_callbacks_of_a_link_keep_the_state_of_their_thread(router: str) -> None:
    """Creating it again for each message takes longer than handling the message."""
    kept, counts = threading.local(), [0]

    def take(*_: object) -> None:
        kept.count = getattr(kept, "count", 0) + 1
        counts.append(kept.count)

    sender, receiver = link_to(router), link_to(router)
    try:
        subscriber = receiver.subscribe("pipros/robot1/t/x", take)

        def is_kept() -> bool:
            sender.put("pipros/robot1/t/x", b"")
            return max(counts) >= 3

        wait_until(is_kept, LIMIT_S, "a third message in one thread")
        subscriber.undeclare()
    finally:
        sender.close()
        receiver.close()


def test_long_answers_delay_none(router: str, hostile: SessionLink, monkeypatch: pytest.MonkeyPatch) -> None:
    gate, key, waiting = threading.Event(), keys.statistics("robot1"), count()

    def answer(_: object, question: ZenohQuestion) -> None:
        if question.asker == "observer":
            next(waiting)
            gate.wait(LIMIT_S)
        question.answer(b"{}")

    monkeypatch.setattr(Statistics, "answer", answer)
    with Member("robot1", router), closing(link_to(router, asker="other")) as other:
        for _ in range(9):
            threading.Thread(target=lambda: hostile.get(key, timeout_s=LIMIT_S), daemon=True).start()
        wait_until(lambda: "count(4)" in repr(waiting), LIMIT_S, "the share of one asker to be used")
        assert other.get(key, timeout_s=LIMIT_S)
        gate.set()


# Topics that a fleet's agent publishes on the local master.


def test_late_subscribers_get_the_last_message_of_many_latching_publishers(
    master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    text: Any = load_message_class("std_msgs/String")
    environment = Environment(master_uri=master.uri)
    with Node("agent", environment=environment) as agent, Node("late", environment=environment) as late:
        entry = DirectoryEntry("/status", text._type, text._md5sum)
        room = SinkRoom(process_limits())
        room.latched = Budget(120_000)
        sink = Sink(agent, entry, "robot1", text._full_text, logging.root, lambda: None, room)
        sequence = count(1)

        def send(publisher: int, data: str, sender: str = "robot1", *, is_compressed: bool = False) -> None:
            attachment = MessageAttachment(
                publisher, "00" * 8, next(sequence), 0, text._md5sum, is_compressed, is_latched=True
            )
            body = BytesIO()
            text(data).serialize(body)
            sink.take(sender, body.getvalue(), pack(attachment))

        for publisher in range(100):
            send(publisher, f"first of {publisher}")
        send(7, "second of 7")
        send(99, "second of 99")

        lock, received = threading.Lock(), set[str]()

        def receive(message: Any) -> None:
            with lock:
                received.add(message.data)

        late.subscribe("/status", text, receive)
        wait_until(lambda: len(received) >= 100, what="the latched messages")
        assert received == {f"first of {each}" for each in range(100) if each not in (7, 99)} | {
            "second of 7",
            "second of 99",
        }
        monkeypatch.setattr("pipros_fleet.sinks.FLEET_MEMBERS", 3)
        for number in range(2, 9):
            send(7, "of a member that leaves", f"robot{number}")
        assert (len(sink.received), 0 < room.latched.used < 3000) == (3, True)
        gate = threading.Event()
        monkeypatch.setattr("pipros_fleet.sinks.decompressed", lambda body, _: gate.wait(LIMIT_S) and body)
        send(1, "large", "robot7", is_compressed=True)
        send(1, "small", "robot8")
        wait_until(lambda: "small" in received, what="the message that is not compressed")
        assert "large" not in received
        gate.set()
        wait_until(lambda: "large" in received, what="the compressed message")
        sink.close()
        send(7, "after the end", "robot2")
        assert room.latched.used == 0


# Services and parameters between the members of a fleet, and what their files forbid.


SetBool: Any = load_service_class("std_srvs/SetBool")
Trigger: Any = load_service_class("std_srvs/Trigger")
FILE = """
share: {parameters: [{name: /public/*, from: [operator]}]}
accept:
  services: [{name: /lamp, from: [operator], timeout_s: 60}, /slow]
  parameters: [{name: /public/speed, from: [operator]}]
"""


def call(member: Member, service: str, request: Any, service_class: Any = SetBool) -> Any:
    node = member.agent_node
    with closing(
        ServiceClient(service, service_class, master=lambda: node.master, calls=OpenCalls())
    ) as client:
        return client.call(request, LIMIT_S)


def ask(member: Member, other: str, verb: str, value: Any, caller: str | None = None) -> Any:
    key = keys.parameters(other, verb, caller or member.name)
    (answer,) = member.link.get(key, b"" if value is None else json.dumps(value).encode(), timeout_s=LIMIT_S)
    return json.loads(answer.payload)


def test_services_of_a_member_are_called_below_its_name(router: str) -> None:
    with Member("robot1", router, FILE) as robot, Member("operator", router) as operator:

        def switch(request: Any) -> Any:
            if not request.data:
                raise ValueError("the lamp is broken")
            return SetBool._response_class(True, "on")

        robot.node("lamp").serve("/lamp", SetBool, switch)
        robot.node("secret").serve("/secret", Trigger, lambda _: Trigger._response_class())
        operator.wait_for_service("/robot1/lamp")
        assert call(operator, "/robot1/lamp", SetBool._request_class(True)).message == "on"
        with pytest.raises(ErrorReply, match="the lamp is broken"):
            call(operator, "/robot1/lamp", SetBool._request_class(False))
        assert "/robot1/secret" not in operator.state().services
        with pytest.raises(ServiceFailed, match="md5sum"):
            call(operator, "/robot1/lamp", Trigger._request_class(), Trigger)

        with pytest.raises(LinkFailed, match=r"\[operator\] is not allowed to call \[/secret\]"):
            operator.link.get(keys.service("robot1", "operator", "/secret"), timeout_s=LIMIT_S)
        with pytest.raises(LinkFailed, match=r"\[stranger\] is not allowed to call \[/lamp\]"):
            operator.link.get(keys.service("robot1", "stranger", "/lamp"), timeout_s=LIMIT_S)


def test_a_service_that_takes_too_long_fails(router: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros_fleet.calls.GRACE_S", 60.0)  # the reason comes from the other member
    is_over = threading.Event()
    file = FILE.replace("timeout_s: 60", "timeout_s: 0.5")
    with Member("robot1", router, file) as robot, Member("operator", router) as operator:

        def wait(_: Any) -> Any:
            is_over.wait(LIMIT_S)
            return SetBool._response_class()

        robot.node("lamp").serve("/lamp", SetBool, wait)
        operator.wait_for_service("/robot1/lamp")
        try:
            with pytest.raises(ErrorReply, match="did not answer in time"):
                call(operator, "/robot1/lamp", SetBool._request_class(True))
        finally:
            is_over.set()


def test_a_call_fails_when_the_member_leaves(router: str) -> None:
    is_called, is_over = threading.Event(), threading.Event()
    errors: list[Exception] = []
    with Member("operator", router) as operator:
        with Member("robot1", router, FILE) as robot:

            def wait(_: Any) -> Any:
                is_called.set()
                is_over.wait(LIMIT_S)
                return SetBool._response_class()

            robot.node("slow").serve("/slow", SetBool, wait)
            operator.wait_for_service("/robot1/slow")

            def make_call() -> None:
                try:
                    call(operator, "/robot1/slow", SetBool._request_class(True))
                except ServiceFailed as error:
                    errors.append(error)

            caller = threading.Thread(target=make_call)
            caller.start()
            assert is_called.wait(LIMIT_S)
            robot.link.close()
            caller.join(LIMIT_S)
            is_over.set()
        assert len(errors) == 1


def test_parameters_are_read_and_set_as_the_file_allows(router: str) -> None:
    with Member("robot1", router, FILE) as robot, Member("operator", router) as operator:
        master = robot.agent_node.master
        for name, value in (("/public/speed", 1.5), ("/public/tree", {"a": [1, "x"]}), ("/secret", 1)):
            master.set_param(name, value)
        wait_until(lambda: "robot1" in operator.agent.statistics()["members"], LIMIT_S, "the member")
        assert ask(operator, "robot1", "get", None) == ["/public/speed"]
        assert ask(operator, "robot1", "get", "/public/speed") == 1.5
        assert ask(operator, "robot1", "get", "/public/tree") == {"a": [1, "x"]}
        assert ask(operator, "robot1", "set", ["/public/speed", 2.5]) is True
        assert master.get_param("/public/speed") == 2.5
        for verb, value, reason in (
            ("get", "/secret", r"\[/secret\] is not shared with \[operator\]"),
            ("get", "/public/none", r"\[/public/none\] is not set"),
            ("get", 5, "must have a global name"),
            ("set", ["/public/tree", 1], r"\[operator\] is not allowed to set parameter \[/public/tree\]"),
            ("set", "nonsense", "must be \\[name, value\\]"),
        ):
            with pytest.raises(LinkFailed, match=reason):
                ask(operator, "robot1", verb, value)
        with pytest.raises(LinkFailed, match="not allowed to set"):
            ask(operator, "robot1", "set", ["/public/speed", 0], caller="stranger")
        assert not operator.agent_node.master.has_param("/robot1"), "trees are never merged"


def test_denied_parameters_are_not_reached_by_other_names(router: str) -> None:
    denied = "[{name: /secret/**, allow: false}, {name: /limit, allow: false}, /**]"
    file = f"share: {{parameters: {denied}}}\naccept: {{parameters: {denied}}}\n"
    with Member("robot1", router, file) as robot, Member("operator", router) as operator:
        master = robot.agent_node.master
        for name in ("/secret/key", "/limit", "/public/a", "/public/b/c"):
            master.set_param(name, 1)
        before = master.get_param("/secret"), master.get_param("/limit")
        wait_until(lambda: "robot1" in operator.agent.statistics()["members"], LIMIT_S, "the member")
        for name in ("//secret/key", "/secret//key/", "secret/key", "/./secret", "/secret/key/"):
            with pytest.raises(LinkFailed):
                ask(operator, "robot1", "get", name)
        assert ask(operator, "robot1", "get", "/secret") == {}
        everything = ask(operator, "robot1", "get", "/")
        assert "secret" not in everything
        assert "limit" not in everything
        assert everything["public"] == {"a": 1, "b": {"c": 1}}
        for name, value in (
            ("//secret/key", 2), ("/secret", {"key": 2}), ("/secret", 2), ("/secret", {}),
            ("/", {"secret": {"key": 2}}), ("/", {"secret/key": 2}), ("/", {}), ("/limit/", 2),
            ("/limit/a", 2),
        ):  # fmt: skip
            with pytest.raises(LinkFailed, match="is not allowed to"):
                ask(operator, "robot1", "set", [name, value])
        deep: Any = 1
        for _ in range(900):
            deep = {"a": deep}
        with pytest.raises(LinkFailed):
            ask(operator, "robot1", "set", ["/public", deep])
        assert (master.get_param("/secret"), master.get_param("/limit")) == before
        assert ask(operator, "robot1", "set", ["/public", {"b": 2}]) is True
        assert master.get_param("/public") == {"b": 2}
