"""Topics between nodes of one process, over real connections."""

import asyncio
import logging
import socket
import threading
from collections.abc import Callable
from contextlib import ExitStack, closing
from typing import Any, NoReturn

import pytest
from geometry_msgs.msg import PointStamped
from std_msgs.msg import Int32, String, UInt8MultiArray
from std_srvs.srv import Empty

from pipros.basics.env import Environment
from pipros.basics.errors import Interrupted, MissingExtra, Refused
from pipros.master.master import Master
from pipros.msg.errors import SerializationError
from pipros.net import master_client, sockets
from pipros.net.incoming import IncomingLink
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.net.timings import LinkTimings
from pipros.node import Node, registration
from pipros.node.endpoints import TypeConflict
from pipros.node.publication import Publication
from pipros.node.service_link import ServiceFailed
from pipros.node.service_server import ServiceServer
from pipros.node.subscription import Subscription
from pipros.node.timings import NodeTimings
from pipros.wire.header import HeaderReader, encode_header
from pipros.wire.xmlrpc import Fault
from tests.support.nodes import Inbox, MakeNode, connected, listening_log, wait_until_connected
from tests.support.ports import ClaimedPort
from tests.support.slaves import Served
from tests.support.waiting import wait_until

pytestmark = pytest.mark.usefixtures("transport")


def test_types_may_be_given_by_name(make_node: MakeNode) -> None:
    inbox = Inbox()
    publisher = connected(make_node("talker"), make_node("listener"), "chat", "std_msgs/String", inbox)
    publisher.publish(String(data="hello"))
    assert inbox.wait(1) == [String(data="hello")]


def test_a_message_reaches_every_subscriber_in_order(make_node: MakeNode) -> None:
    talker, one, two = make_node("talker"), make_node("one"), make_node("two")
    inboxes = Inbox(), Inbox()
    one.subscribe("chat", String, inboxes[0])
    publisher = talker.advertise("chat", String, queue_size=0)
    two.subscribe("/chat", String, inboxes[1])
    wait_until_connected(publisher, 2)
    for number in range(2000):
        publisher.publish(String(data=str(number)))
    for inbox in inboxes:
        assert [message.data for message in inbox.wait(2000)] == [str(number) for number in range(2000)]


@pytest.mark.parametrize("queue_size", [0, None])
@pytest.mark.parametrize("transport", ["TCPROS"], indirect=True)
def test_messages_of_a_dense_run_share_packets_unless_the_subscriber_wants_no_delay(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch, queue_size: int | None
) -> None:
    changes: list[bool] = []
    monkeypatch.setattr(sockets, "share_packets", lambda _, share: changes.append(share))
    talker, patient, hasty = make_node("talker"), make_node("patient"), make_node("hasty")
    inboxes = Inbox(), Inbox()
    patient.subscribe("chat", Int32, inboxes[0], tcp_nodelay=False)
    hasty.subscribe("chat", Int32, inboxes[1], tcp_nodelay=True)
    publisher = talker.advertise("chat", Int32, queue_size=queue_size)
    wait_until_connected(publisher, 2)
    changes.clear()  # whatever the setting for new links
    sent = 0

    def publish_closely() -> bool:
        nonlocal sent
        for _ in range(1000):
            publisher.publish(Int32(sent))
            sent += 1
        return True in changes

    wait_until(publish_closely)
    wait_until(lambda: changes[-1] is False, what=lambda: f"packets are shared for ever: {changes}")
    assert changes == [True, False] * (len(changes) // 2), "only the patient one's link changes"
    for inbox in inboxes:
        assert [message.data for message in inbox.wait(sent)] == list(range(sent))


def test_the_connection_header_says_who_sent_it(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    inbox = Inbox()
    publisher = connected(talker, listener, "chat", String, inbox)
    publisher.publish(String("x"))
    assert inbox.wait()[0]._connection_header == {
        "callerid": "/talker", "latching": "0", "md5sum": "992ce8a1687cec8c8bd883ec73ca41d1",
        "message_definition": String._full_text, "topic": "/chat", "type": "std_msgs/String",
    }  # fmt: skip


def test_a_latched_topic_sends_its_last_message_to_later_subscribers(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("map", String, latch=True)
    publisher.publish(String("old"))
    publisher.publish(String("new"))
    inbox = Inbox.of(listener, "map", String)
    assert [message.data for message in inbox.wait()] == ["new"]
    assert inbox.messages[0]._connection_header["latching"] == "1"


def test_a_second_callback_gets_the_last_latched_message_at_once(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("map", String, latch=True)
    publisher.publish(String("old"))
    first, second, third = Inbox(), Inbox(), Inbox()
    listener.subscribe("map", String, first)
    first.wait()
    listener.subscribe("map", String, second)
    assert [message.data for message in second.messages] == ["old"]
    publisher.publish(String("new"))
    first.wait(2)
    listener.subscribe("map", String, third)
    assert [message.data for message in third.messages] == ["new"]
    assert [message.data for message in second.wait(2)] == ["old", "new"]


def test_a_callback_added_amid_latched_messages_gets_each_message_once(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("count", Int32, latch=True, queue_size=0)
    first = Inbox.of(listener, "count", Int32)
    wait_until_connected(publisher)
    later = []
    for number in range(400):
        publisher.publish(Int32(number))
        if number % 20 == 10:
            later.append(Inbox())
            listener.subscribe("count", Int32, later[-1])
    first.wait(400)
    for inbox in later:
        wait_until(lambda inbox=inbox: inbox.messages and inbox.messages[-1].data == 399)  # type: ignore[misc]
        begin = inbox.messages[0].data
        assert [message.data for message in inbox.messages] == list(range(begin, 400))


def test_headers_are_numbered_by_the_publisher(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    inbox = Inbox()
    publisher = connected(talker, listener, "p", PointStamped, inbox)
    message = PointStamped()
    message.header.seq, message.header.frame_id = 77, "map"
    publisher.publish(message)
    publisher.publish(message)
    assert [(item.header.seq, item.header.frame_id) for item in inbox.wait(2)] == [(1, "map"), (2, "map")]


def test_large_messages_arrive_whole(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    inbox = Inbox()
    publisher = connected(talker, listener, "cloud", UInt8MultiArray, inbox, queue_size=0)
    body = bytes(range(256)) * 40_000
    for _ in range(3):
        publisher.publish(UInt8MultiArray(data=body))
    assert all(message.data == body for message in inbox.wait(3))


def test_a_buffer_may_be_used_again_once_publish_has_returned(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    inbox, gate = Inbox(), threading.Event()
    publisher = connected(
        talker,
        listener,
        "cloud",
        UInt8MultiArray,
        lambda message: (gate.wait(60), inbox(message)),
        queue_size=0,
    )
    data = bytearray(4_000_000)
    for value in range(8):
        data[:] = bytes([value]) * len(data)
        publisher.publish(UInt8MultiArray(data=data))
    gate.set()
    assert [set(message.data) for message in inbox.wait(8)] == [{value} for value in range(8)]


def test_a_slow_callback_with_queue_size_1_sees_the_newest_message(make_node: MakeNode) -> None:
    # Every callback counts as slow. On a busy machine, messages that were sent may take longer to be read.
    links = LinkTimings(slow_delivery_s=0.0, drain_limit_s=60.0, quiet_s=1.0)
    talker, listener = make_node("talker"), make_node("listener", timings=NodeTimings(links=links))
    inbox, entered, gate = Inbox(), threading.Event(), threading.Event()

    def slow(message: Any) -> None:
        inbox(message)
        entered.set()
        gate.wait(60)

    subscriber = listener.subscribe("cloud", UInt8MultiArray, slow, queue_size=1)
    publisher = talker.advertise("cloud", UInt8MultiArray, queue_size=0)
    wait_until_connected(publisher)
    publisher.publish(UInt8MultiArray(data=b"\0" * 4_000))
    assert entered.wait(60)
    for value in range(1, 30):
        publisher.publish(UInt8MultiArray(data=bytes([value]) * 4_000))
    wait_until(lambda: publisher.statistics()["frames"] == 30)
    gate.set()
    assert [message.data[0] for message in inbox.wait(2)] == [0, 29]
    assert subscriber.statistics()["dropped"] == 28


def test_a_slow_subscriber_does_not_delay_the_others(make_node: MakeNode) -> None:
    talker, slow, quick = make_node("talker"), make_node("slow"), make_node("quick")
    gate, inbox = threading.Event(), Inbox()
    slow.subscribe("cloud", UInt8MultiArray, lambda _: gate.wait(60))
    quick.subscribe("cloud", UInt8MultiArray, inbox)
    publisher = talker.advertise("cloud", UInt8MultiArray, queue_size=2)
    wait_until_connected(publisher, 2)
    message = UInt8MultiArray(data=b"x" * 1_000_000)
    for count in range(1, 41):
        publisher.publish(message)
        inbox.wait(count)
    assert publisher.statistics()["dropped"] > 0
    gate.set()


def test_messages_of_a_restarted_publisher_are_received(make_node: MakeNode) -> None:
    listener, inbox = make_node("listener"), Inbox()
    listener.subscribe("chat", String, inbox)
    for round_number in range(3):
        talker = make_node("talker")
        publisher = talker.advertise("chat", String)
        wait_until_connected(publisher)
        publisher.publish(String(str(round_number)))
        inbox.wait(round_number + 1)
        talker.shutdown("restart")
    assert [message.data for message in inbox.messages] == ["0", "1", "2"]


def test_a_subscriber_without_a_thread_for_a_publisher_tries_again(make_node: MakeNode, monkeypatch) -> None:
    start, refused = IncomingLink.start, threading.Event()

    def refuse_once(link: IncomingLink) -> None:
        if not refused.is_set():
            refused.set()
            raise RuntimeError("can't start new thread")
        start(link)

    monkeypatch.setattr(IncomingLink, "start", refuse_once)
    log, lines = listening_log()
    talker, listener, inbox = make_node("talker"), make_node("listener", log=log), Inbox()
    talker.advertise("chat", Int32, latch=True).publish(Int32(1))
    subscriber = listener.subscribe("chat", Int32, inbox)
    inbox.wait()
    assert refused.is_set()
    assert subscriber.connection_count == 1
    assert "can't start new thread" in lines[0]


def test_a_link_opened_during_interpreter_shutdown_is_dropped_silently(make_node, monkeypatch) -> None:
    refused = threading.Event()

    def refuse(_: IncomingLink) -> None:
        refused.set()
        raise RuntimeError("can't create new thread at interpreter shutdown")  # Python 3.12 and later

    monkeypatch.setattr(IncomingLink, "start", refuse)
    log, lines = listening_log()
    talker, listener = make_node("talker"), make_node("listener", log=log)
    publisher = talker.advertise("chat", Int32)
    subscriber = listener.subscribe("chat", Int32, Inbox())
    assert refused.wait(60)
    wait_until(lambda: publisher.connection_count == 0, what="the end of the link")
    listener.shutdown("the end")
    assert subscriber.connection_count == 0
    assert lines == ["signal_shutdown [the end]"]


def test_a_publisher_announced_during_the_registration_of_a_subscriber_is_received(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The master announces the publisher before its response, which lacks it, is read."""
    asked, may_answer = threading.Event(), threading.Event()

    async def request_topic(*_: Any) -> list[Any]:
        asked.set()
        await asyncio.to_thread(may_answer.wait, 30)
        return [1, "", ["TCPROS", "127.0.0.1", talker.endpoints.port]]

    listener = make_node("listener")
    register = listener.master.register_subscriber

    def register_slowly(topic: str, type_name: str, api: str) -> Any:
        publishers = register(topic, type_name, api)
        with closing(MasterClient(listener.master.uri, "/talker")) as client:
            client.register_publisher(topic, type_name, server.api)
        assert asked.wait(30)
        return publishers

    inbox = Inbox()
    with Master(port=0) as master_of_talker, Served({"requestTopic": request_topic}) as server:
        talker = Node("talker", environment=Environment(master_uri=master_of_talker.uri))
        with talker:
            talker.advertise("/chatter", String, latch=True).publish(String("here"))
            monkeypatch.setattr(listener.master, "register_subscriber", register_slowly)
            listener.subscribe("/chatter", String, inbox)
            with RpcClient(listener.uri) as client:  # its response arrives after the list was accepted
                client.call("getPid", "/test")
            may_answer.set()
            assert inbox.wait()[0].data == "here"


def test_the_last_unregister_ends_the_topic(make_node: MakeNode, master: Master) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    first, second = talker.advertise("chat", String), talker.advertise("chat", String)
    subscriber = listener.subscribe("chat", String, print)
    wait_until_connected(first)
    first.unregister()
    first.unregister()
    assert second.connection_count == 1
    second.unregister()
    wait_until(lambda: subscriber.connection_count == 0)
    subscriber.unregister()
    assert talker.master.get_system_state()[:2] == [[], []]


def raising(error: Exception) -> Callable[[Any], NoReturn]:
    def callback(_: Any) -> NoReturn:
        raise error

    return callback


@pytest.mark.parametrize(
    ("error", "count", "end"),
    [
        (ValueError("oops"), 3, ""), (MissingExtra("it needs numpy"), 1, ": it needs numpy"),
        (Interrupted("the node was shut down while it waited"), 0, ""),
    ],
    ids=["an error", "a library that is missing, once", "the end of the node, not"],
)  # fmt: skip
def test_an_exception_in_a_callback_is_logged_and_the_next_is_called(make_node, error, count, end) -> None:
    log, lines = listening_log()
    talker, listener, inbox = make_node("talker"), make_node("listener", log=log), Inbox()
    listener.subscribe("chat", String, raising(error))
    listener.subscribe("chat", String, lambda message, args: inbox((message.data, args)), callback_args=7)
    publisher = talker.advertise("chat", String)
    wait_until_connected(publisher)
    for _ in range(3):
        publisher.publish(String("x"))
    assert inbox.wait(3) == [("x", 7)] * 3
    assert len(lines) == count
    assert all(line.startswith("bad callback:") and line.endswith(end) for line in lines)


def test_a_call_whose_node_ends_leaves_no_traceback(make_node: MakeNode) -> None:
    log, lines = listening_log()
    make_node("server", log=log).serve("wait", Empty, raising(Interrupted("the node was shut down")))
    with pytest.raises(ServiceFailed):
        make_node("client").client("wait", Empty).call(Empty._request_class(), 30)
    assert lines == []


def test_a_failed_publish_sends_nothing_and_does_not_affect_the_next(make_node: MakeNode) -> None:
    talker, listener, inbox = make_node("talker"), make_node("listener"), Inbox()
    publisher = connected(talker, listener, "n", Int32, inbox)
    with pytest.raises(SerializationError):
        publisher.publish(Int32("text"))
    publisher.publish(Int32(5))
    assert inbox.wait()[0].data == 5


def test_another_type_is_refused_and_both_md5sums_are_named(make_node: MakeNode) -> None:
    log, lines = listening_log()
    talker, listener = make_node("talker"), make_node("listener", log=log)
    talker.advertise("chat", String)
    listener.subscribe("chat", Int32, print)
    wait_until(lambda: lines)
    assert String._md5sum in lines[0]
    assert Int32._md5sum in lines[0]


def test_one_node_cannot_use_a_topic_with_two_types(make_node: MakeNode) -> None:
    node = make_node("node")
    node.advertise("chat", String)
    node.subscribe("chat", String, print)
    with pytest.raises(TypeConflict, match=r"\[/chat\] is already used with md5sum 992ce"):
        node.advertise("chat", Int32)
    with pytest.raises(TypeConflict):
        node.subscribe("chat", Int32, print)


def test_a_node_that_its_master_lost_registers_again_and_keeps_its_links(claimed_port: ClaimedPort) -> None:
    inbox, environment = Inbox(), Environment(master_uri=claimed_port.uri)
    with ExitStack() as running:
        with Master(port=claimed_port.number):
            talker, listener = (
                running.enter_context(Node(name, environment=environment)) for name in ("talker", "listener")
            )
            publisher = connected(talker, listener, "chat", String, inbox)
        publisher.publish(String("without a master"))
        inbox.wait(1)
        again = running.enter_context(Master(port=claimed_port.number))
        client = running.enter_context(Node("observer", environment=environment)).master
        wait_until(
            lambda: client.get_system_state()[:2] == [[["/chat", ["/talker"]]], [["/chat", ["/listener"]]]]
        )
        publisher.publish(String("with a new one"))
        assert [message.data for message in inbox.wait(2)] == ["without a master", "with a new one"]
        assert again.uri == client.uri


def test_a_node_that_ends_leaves_no_registrations(make_node: MakeNode) -> None:
    node, observer = make_node("node", timings=NodeTimings(unregister_s=60.0)), make_node("observer")
    node.advertise("a", String)
    node.subscribe("b", String, print)
    node.serve("c", Empty, lambda _: Empty._response_class())
    assert observer.master.get_system_state() == [
        [["/a", ["/node"]]], [["/b", ["/node"]]], [["/c", ["/node"]]],
    ]  # fmt: skip
    node.shutdown("done")
    assert observer.master.get_system_state() == [[], [], []]


def test_topics_unregistered_during_shutdown_are_not_left_at_the_master(make_node, monkeypatch) -> None:
    observer, node = make_node("observer"), make_node("busy", timings=NodeTimings(unregister_s=60.0))
    publisher = node.advertise("/chatter", String)
    end, is_interrupted = threading.Thread(target=node.shutdown), threading.Event()

    def be_interrupted(*_: object) -> NoReturn:
        end.start()
        assert is_interrupted.wait(60)
        raise Interrupted("the node ends")

    monkeypatch.setattr(node.master, "call", be_interrupted)
    monkeypatch.setattr(node.master, "interrupt", lambda _, grace_s: is_interrupted.set())
    publisher.unregister()
    end.join(60)
    assert observer.master.get_system_state() == [[], [], []]


@pytest.mark.parametrize("grace_s", [60.0, 0.0])
def test_shutdown_waits_for_a_running_callback_that_ends_in_time(make_node: MakeNode, grace_s: float) -> None:
    listener = make_node("listener", timings=NodeTimings(callback_grace_s=grace_s))
    has_begun, may_end, has_ended = threading.Event(), threading.Event(), threading.Event()

    def callback(_: Any) -> None:
        has_begun.set()
        if grace_s:
            threading.Timer(0.3, may_end.set).start()  # later than everything else that shutdown does
        may_end.wait()
        has_ended.set()

    publisher = connected(make_node("talker"), listener, "chat", String, callback)
    publisher.publish(String(data="hello"))
    assert has_begun.wait(60)
    listener.shutdown()
    assert has_ended.is_set() == (grace_s > 0)
    may_end.set()


def test_links_of_a_topic_unregistered_during_shutdown_are_closed(make_node: MakeNode, monkeypatch) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = connected(talker, listener, "chat", String, Inbox())
    (subscriber,) = publisher.publication.links
    is_removed, has_ended = threading.Event(), threading.Event()
    remove = talker.registrations.remove

    def remove_slowly(entry: registration.Entry) -> None:
        remove(entry)
        is_removed.set()
        assert has_ended.wait(60)

    monkeypatch.setattr(talker.registrations, "remove", remove_slowly)
    unregistering = threading.Thread(target=publisher.unregister)
    unregistering.start()
    assert is_removed.wait(60)
    talker.shutdown()
    has_ended.set()
    unregistering.join(60)
    assert subscriber.link.sock.fileno() == -1


@pytest.mark.parametrize("kind", ["publication", "subscription", "service"])
def test_topics_added_during_shutdown_do_not_disturb_it(make_node: MakeNode, monkeypatch, kind: str) -> None:
    node = make_node("busy")
    node.advertise("/before", String)
    node.subscribe("/before", String, lambda _: None)
    node.serve("/before", Empty, lambda _: Empty._response_class())
    add = {
        "publication": lambda: node.advertise("/meanwhile", String),
        "subscription": lambda: node.subscribe("/meanwhile", String, lambda _: None),
        "service": lambda: node.serve("/meanwhile", Empty, lambda _: Empty._response_class()),
    }[kind]
    closed = {"publication": Publication, "subscription": Subscription, "service": ServiceServer}[kind]
    close = closed.close

    def close_and_add(endpoint: Any, *arguments: Any) -> None:
        close(endpoint, *arguments)
        add()

    with monkeypatch.context() as patched:
        patched.setattr(closed, "close", close_and_add)
        node.shutdown()
    assert node.is_shutdown


def test_only_hooks_may_publish_while_the_node_ends(make_node: MakeNode) -> None:
    robot, motor, inbox = make_node("robot"), make_node("motor"), Inbox()
    publisher = connected(robot, motor, "speed", Int32, inbox)
    seen: list[bool] = []

    def stop() -> None:
        seen.append(robot.is_shutdown)
        publisher.publish(Int32(0))
        other = threading.Thread(target=lambda: (seen.append(robot.is_shutdown), publisher.publish(Int32(9))))
        other.start()
        other.join()

    robot.on_shutdown(stop)
    publisher.publish(Int32(9))
    robot.shutdown("stop")
    inbox.wait(2)
    publisher.publish(Int32(9))
    assert seen == [False, True]
    assert [message.data for message in inbox.messages] == [9, 0]


def test_the_last_published_message_arrives_although_the_node_ends(make_node: MakeNode) -> None:
    patient = NodeTimings(close_flush_s=60.0)  # the listener may have to wait for a processor
    talker, listener, inbox = make_node("talker", timings=patient), make_node("listener"), Inbox()
    publisher = connected(talker, listener, "cloud", UInt8MultiArray, inbox, queue_size=0)
    for number in range(20):
        publisher.publish(UInt8MultiArray(data=bytes([number]) * 1_000_000))
    talker.shutdown("done")
    assert [message.data[0] for message in inbox.wait(20)] == list(range(20))


def test_a_duplicate_name_ends_the_older_node_which_logs_why(make_node: MakeNode) -> None:
    log, lines = listening_log()
    log.setLevel(logging.WARNING)
    unaware = make_node("double", log=log)
    unaware.advertise("a", String)
    make_node("double").advertise("a", String)
    assert unaware.wait_for_shutdown(60)
    assert lines == ["/double shuts down on request: [/double] Reason: new node registered with same name"]
    reasons: list[str] = []
    old = make_node("twin", on_shutdown_request=lambda reason: (reasons.append(reason), old.shutdown(reason)))
    old.advertise("a", String)
    new = make_node("twin")
    new.advertise("a", String)
    assert old.wait_for_shutdown(60)
    assert reasons == ["[/twin] Reason: new node registered with same name"]
    assert not new.is_shutdown


def test_the_slave_api_answers_as_genuine_nodes_do(make_node: MakeNode, master: Master) -> None:
    node = make_node("talker")
    node.advertise("chat", String)
    port = node.endpoints.port
    with RpcClient(node.uri) as peer:
        assert peer.call("getPublications", "/q") == [1, "publications", [["/chat", "std_msgs/String"]]]
        assert peer.call("getSubscriptions", "/q") == [1, "subscriptions", []]
        assert peer.call("getBusStats", "/q") == [1, "", [[["/chat", 0, []]], [], []]]
        assert peer.call("getBusInfo", "/q") == [1, "bus info", []]
        assert peer.call("getName", "/q") == [1, "", "/talker"]
        assert peer.call("getMasterUri", "/q") == [1, master.uri, master.uri]
        ready = [1, f"ready on 127.0.0.1:{port}", ["TCPROS", "127.0.0.1", port]]
        assert peer.call("requestTopic", "/q", "chat", [["UDPROS"], ["TCPROS"]]) == ready
        assert peer.call("requestTopic", "/q", "/chat", [["X"]])[0] == 0
        assert peer.call("requestTopic", "/q", "/nope", [["TCPROS"]]) == [
            -1, "Not a publisher of [/nope]", [],
        ]  # fmt: skip
        assert peer.call("publisherUpdate", "/q", "/nope", []) == [1, "", 0]
        assert peer.call("publisherUpdate", "/q", "/a", "x")[0] == -1
        assert peer.call("paramUpdate", "/q", "/a", 1) == [-1, "not subscribed", 0]
        assert peer.call("getPid") == [-1, "missing required caller_id parameter", -1]
        assert peer.call("getPid", "/q", 1) == [-1, "Error: bad call arity", -1]
        assert peer.call("shutdown", "/q") == [-1, "Error: bad call arity", 0]


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ({"topic": "/nope", "md5sum": "*", "callerid": "/q"}, "is not a publisher of [/nope]"),
        ({"topic": "chat", "md5sum": "*", "callerid": "/q"}, "is not a publisher of [chat]"),
        ({"topic": "/chat", "callerid": "/q"}, "Missing required 'md5sum' field"),
        ({"callerid": "/q"}, "no topic or service name detected"),
        ({"service": "/nope", "md5sum": "*", "callerid": "/q"}, "does not provide the service [/nope]"),
    ],
)
def test_a_wrong_request_gets_the_reason(make_node: MakeNode, fields: dict[str, str], problem: str) -> None:
    node = make_node("talker")
    node.advertise("chat", String)
    with socket.create_connection(("127.0.0.1", node.endpoints.port), 10) as peer:
        peer.sendall(encode_header(fields))
        reader = HeaderReader()
        while (answer := reader.feed(peer.recv(4096))) is None:
            pass
        assert problem in answer["error"]
        assert peer.recv(1) == b""


def test_registering_an_illegal_topic_is_reported_in_the_masters_words(make_node: MakeNode) -> None:
    log, lines = listening_log()
    make_node("talker", log=log).advertise("battery topic", String)
    assert lines == [
        "unable to register publication [/battery topic] with master: "
        "ERROR: parameter [topic] contains illegal chars"
    ]


def test_a_node_reads_and_sets_parameters(make_node: MakeNode) -> None:
    node, other = make_node("node"), make_node("other")
    node.params.set("~rate", 5)
    assert other.params.get("/node/rate") == 5
    assert node.params.get_cached("~rate") == 5
    other.params.set("/node/rate", 6)
    wait_until(lambda: node.params.get_cached("~rate") == 6)
    assert node.params.search("rate") == "/node/rate"
    node.params.delete("~rate")
    wait_until(lambda: not other.params.has("/node/rate"))
    with pytest.raises(LookupError, match=r"parameter \[/node/rate\] is not set"):
        node.params.get("~rate")


def test_a_refused_call_names_the_refusing_server(make_node: MakeNode) -> None:
    with pytest.raises(Refused, match="unknown node"):
        make_node("node").master.lookup_node("/nobody")


@pytest.mark.parametrize("has_multicall", [True, False])
def test_a_node_with_many_topics_unregisters_them_together(master, monkeypatch, has_multicall: bool) -> None:
    calls: list[str] = []

    class CountingClient(RpcClient):
        def call(self, method: str, *params: Any, **options: Any) -> Any:
            calls.append(method)
            if method == "system.multicall" and not has_multicall:
                raise Fault(1, "unknown method")
            return super().call(method, *params, **options)

    monkeypatch.setattr(master_client, "RpcClient", CountingClient)
    environment = Environment(master_uri=master.uri)
    with Node("many", environment=environment) as node:
        for number in range(50):
            node.advertise(f"p{number}", String)
            node.subscribe(f"q{number}", String, print)
        calls.clear()
    ending = [call for call in calls if call == "system.multicall" or call.startswith("unregister")]
    state = MasterClient(master.uri, "/me").get_system_state()

    assert state == [[], [], []]
    assert len(ending) < 15 if has_multicall else len(ending) > 100
