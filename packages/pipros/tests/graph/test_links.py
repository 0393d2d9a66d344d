"""Links of nodes: latched messages, bad peers, refused names, failing registrations, and await."""

import asyncio
import logging
import threading
from collections.abc import Callable, Coroutine, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO

import pytest
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool, Trigger

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError, Unreachable
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.net.rpc_async_client import AsyncRpcClient
from pipros.net.rpc_client import RpcClient
from pipros.node import Node
from pipros.node.publisher import Publisher
from pipros.node.registration import PublicationEntry, Registrations
from pipros.node.service_link import CallTimeout
from pipros.node.timings import NodeTimings
from pipros_tools.cli.command_node import command_node
from tests.support.bags import bag_bytes
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.ros import RosSystem
from tests.support.slaves import GarbageServer, SilentSlave
from tests.support.waiting import wait_until

# A message that takes long to encode, while subscribers connect and disconnect and other nodes call.


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
    inbox = Inbox.of(listener, "map", String)
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
    inbox = Inbox.of(staying, "map", String)
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


# One bad publisher, subscriber or service among good ones closes only its own link.


PLACES = pytest.mark.parametrize("place", range(3), ids=["first", "middle", "last"])
KINDS = ["dead", "silent", "garbage", "no URI", "other type"]


@pytest.fixture
def add_bad(master: Master, make_node: MakeNode) -> Iterator[Callable[[str, bool], None]]:
    """Return a function that registers a bad publisher or subscriber of `/topic`, and a bad service."""
    with ExitStack() as stack:

        def add(kind: str, is_publisher: bool) -> None:
            if kind == "other type":
                node = make_node("bad")
                if is_publisher:
                    node.advertise("/topic", Int32, latch=True).publish(Int32(5))
                else:
                    node.subscribe("/topic", Int32, lambda _: None)
                return
            api = {"dead": "http://127.0.0.1:1/", "no URI": "http://[::1"}.get(kind, "")
            if kind == "silent":
                silent = SilentSlave()
                stack.callback(silent.stop)
                api = silent.api
            elif kind == "garbage":
                garbage = GarbageServer(b"\xff\x00\xff\xff garbage\r\n\r\n")
                stack.callback(garbage.stop)
                api = f"http://127.0.0.1:{garbage.port}/"
            client = MasterClient(master.uri, "/bad")
            register = client.register_publisher if is_publisher else client.register_subscriber
            register("/topic", "std_msgs/String", api)
            client.register_service("/bad_service", f"rosrpc://{api.partition('://')[2]}", api)
            client.close()

        yield add


@PLACES
@pytest.mark.parametrize("kind", KINDS)
def test_a_subscriber_hears_the_good_publishers(kind, place, make_node, add_bad) -> None:
    for number in range(3):
        if number == place:
            add_bad(kind, True)
        else:
            make_node(f"good_{number}").advertise("/topic", String, latch=True).publish(
                String(f"from {number}")
            )
    inbox = Inbox.of(make_node("listener"), "/topic", String)
    heard = {f"from {number}" for number in range(3) if number != place}
    wait_until(lambda: {message.data for message in inbox.messages} == heard)


@PLACES
@pytest.mark.parametrize("kind", KINDS)
def test_a_publisher_reaches_the_good_subscribers(kind, place, make_node, add_bad) -> None:
    inboxes = []
    for number in range(3):
        if number == place:
            add_bad(kind, False)
        else:
            inboxes.append(Inbox())
            make_node(f"good_{number}").subscribe("/topic", String, inboxes[-1])
    make_node("talker").advertise("/topic", String, latch=True).publish(String("hello"))
    for inbox in inboxes:
        assert inbox.wait()[0].data == "hello"


@pytest.mark.parametrize("kind", KINDS[:-1])
def test_the_good_services_of_a_caller_answer(kind, make_node, add_bad: Callable[[str, bool], None]) -> None:
    add_bad(kind, True)
    make_node("server").serve("/good_service", Trigger, lambda _: Trigger._response_class(True, "yes"))
    caller = make_node("caller")
    bad, good = (caller.client(name, Trigger) for name in ("/bad_service", "/good_service"))
    with pytest.raises(PiprosError):
        bad.call(Trigger._request_class(), 0.5)
    assert good.call(Trigger._request_class(), 30.0).message == "yes"


# Registrations that fail while the master is not reachable.


API = "http://127.0.0.1:1/"


def test_a_failed_registration_is_repeated_while_the_master_knows_the_node(master, monkeypatch) -> None:
    client = MasterClient(master.uri, "/talker")
    registrations = Registrations(client, "/talker", API, logging.getLogger(__name__))
    registrations.add(PublicationEntry("/registered", "std_msgs/String"))

    with monkeypatch.context() as broken:

        def unreachable(*_: object, **__: object) -> None:
            raise Unreachable("127.0.0.1:11311", "timed out")

        broken.setattr(client, "register_publisher", unreachable)
        late, removed = (PublicationEntry(topic, "std_msgs/String") for topic in ("/late", "/removed"))
        registrations.add(late)
        registrations.add(removed)
        registrations.remove(removed)
    assert published(client) == ["/registered"]

    async def watch() -> None:
        watching = asyncio.create_task(registrations.watch())
        while published(client) == ["/registered"]:
            await asyncio.sleep(0.02)
        watching.cancel()

    asyncio.run(asyncio.wait_for(watch(), 30))
    assert published(client) == ["/late", "/registered"]
    registrations.close()
    assert published(MasterClient(master.uri, "/test")) == []


def test_a_node_without_other_registrations_reports_a_refusal_once(master, monkeypatch, caplog) -> None:
    client = MasterClient(master.uri, "/talker")
    registrations = Registrations(client, "/talker", API, logging.getLogger(__name__))
    registrations.add(PublicationEntry("/bad name", "std_msgs/String"))
    turns = iter(range(3))

    async def sleep(_: float) -> None:
        if next(turns, None) is None:
            raise asyncio.CancelledError

    own = SimpleNamespace(sleep=sleep, get_running_loop=asyncio.get_running_loop)
    monkeypatch.setattr("pipros.node.registration.asyncio", own)
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(registrations.watch())
    assert caplog.text.count("unable to register publication [/bad name] with master") == 1
    registrations.close()


@pytest.mark.parametrize("stays_open", [True, False])
def test_a_node_asks_at_once_when_its_connection_to_the_master_ends(
    stays_open: bool, master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    registrations = Registrations(MasterClient(master.uri, "/talker"), "/talker", API, logging.getLogger())
    registrations.add(PublicationEntry("/registered", "std_msgs/String"))
    asked: list[object] = []
    waits: list[float] = []

    class Client(AsyncRpcClient):
        async def post(self, document: bytes, *, timeout_s: float | None) -> Any:
            asked.append(await super().post(document, timeout_s=timeout_s))
            if not stays_open and self._connection is not None:
                self._connection.close()
            return asked[-1]

        async def wait_while_connected(self, timeout_s: float) -> None:
            waits.append(timeout_s)
            await super().wait_while_connected(timeout_s)

    async def watch() -> None:
        watching = asyncio.create_task(registrations.watch())
        while len(waits) < (2 if stays_open else 4):  # before the next question
            await asyncio.sleep(0.01)
        watching.cancel()

    monkeypatch.setattr("pipros.node.registration.AWAY_INTERVAL_S", 0.01 if stays_open else 0.05)
    monkeypatch.setattr("pipros.node.registration.ASK_INTERVAL_S", 1e6)
    monkeypatch.setattr("pipros.node.registration.AsyncRpcClient", Client)
    asyncio.run(asyncio.wait_for(watch(), 30))
    assert asked[:3] == [[1, "node api", API]] * (1 if stays_open else 3)
    registrations.close()


def published(client: MasterClient) -> list[str]:
    return sorted(topic for topic, _ in client.get_system_state()[0])


# Nodes with topic names that every master refuses, for example from a bag.


@pytest.mark.parametrize("topic", ["/a\x1b[31m\nb", "/a b", "", "/", "/a\xe9"])
def test_an_illegal_topic_is_one_error(topic: str, ros: RosSystem, master: Master, tmp_path: Path) -> None:
    path = tmp_path / "x.bag"
    path.write_bytes(bag_bytes([(topic, Int32(1), 1, 0), ("/b", Int32(1), 1, 0)]))
    done = ros.pipros.run("rosbag", "play", "-q", path, ROS_MASTER_URI=master.uri)

    shown = repr(topic)[1:-1].replace("\\xe9", "\xe9")
    assert done.returncode == 1
    assert done.output == f"ERROR: [{shown}] is not a legal topic name. Play other topics with --topics"
    done = ros.pipros.run("rosbag", "play", "-q", path, "--topics", "/b", ROS_MASTER_URI=master.uri)
    assert (done.returncode, done.output) == (0, "")


def test_a_name_that_cannot_be_encoded_is_reported_and_the_node_ends_properly(
    master: Master, make_node: MakeNode, caplog: pytest.LogCaptureFixture
) -> None:
    node = make_node("talker", timings=NodeTimings(unregister_s=60.0))
    node.log.addHandler(caplog.handler)
    node.advertise("/good", String)
    node.advertise("/a\x1b", String)
    node.advertise("/last", String)

    assert "unable to register publication [/a\\x1b] with master" in caplog.text
    node.shutdown()
    client = MasterClient(master.uri, "/test")
    publishers, _, _ = client.call("getSystemState")
    assert publishers == []
    client.close()


def test_a_failing_shutdown_still_closes_the_loop(master: Master, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise, the loop would continue with a closed signal socket."""

    def fail(_: Any) -> None:
        raise RuntimeError("of the test")

    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    monkeypatch.setattr(Registrations, "close", fail)
    before = set(threading.enumerate())
    with pytest.raises(RuntimeError, match="of the test"), command_node("failing") as node:
        assert [thread for thread in threading.enumerate() if thread.name.endswith(node.name)]
    assert [
        thread.name for thread in set(threading.enumerate()) - before if thread.name.endswith(node.name)
    ] == []


# The asynchronous API of a node: topics and services with `await`.


def run(coroutine: Coroutine[Any, Any, Any]) -> Any:
    return asyncio.run(asyncio.wait_for(coroutine, 60))


def test_messages_are_iterated_in_order_until_the_node_ends(make_node: MakeNode, master: Master) -> None:
    publisher = make_node("talker").advertise("chat", String, queue_size=0)

    async def listen() -> list[str]:
        heard = []
        async with Node("listener", environment=Environment(master_uri=master.uri)) as node:
            subscriber = node.subscribe("chat", String)
            await asyncio.to_thread(wait_until_connected, publisher)
            for number in range(5):
                publisher.publish(String(str(number)))
            async for message in subscriber:
                heard.append(message.data)
                if len(heard) == 5:
                    threading.Thread(target=node.shutdown).start()
        return heard

    assert run(listen()) == ["0", "1", "2", "3", "4"]


def test_unregistering_ends_the_iteration(make_node: MakeNode) -> None:
    node = make_node("listener")

    async def listen() -> int:
        subscriber = node.subscribe("chat", String)
        asyncio.get_running_loop().call_soon(subscriber.unregister)
        return len([message async for message in subscriber])

    assert run(listen()) == 0


def test_a_subscriber_with_a_callback_is_not_an_iterator(make_node: MakeNode) -> None:
    with pytest.raises(TypeError, match=r"\[/chat\] was subscribed to with a callback"):
        aiter(make_node("listener").subscribe("chat", String, print))


def test_a_service_is_served_and_called_by_coroutines(make_node: MakeNode) -> None:
    server, client = make_node("server"), make_node("client")

    async def handle(request: Any) -> Any:
        await asyncio.sleep(0)
        return SetBool._response_class(success=request.data, message=threading.current_thread().name)

    async def talk() -> Any:
        server.serve("set", SetBool, handle)
        return await client.call("set", SetBool, SetBool._request_class(data=True), timeout_s=30)

    response = run(talk())
    assert (response.success, response.message) == (True, "MainThread")


def test_an_awaited_call_can_be_limited_and_cancelled(make_node: MakeNode) -> None:
    server, client, gate = make_node("server"), make_node("client"), threading.Event()
    entered = threading.Event()
    server.serve("hang", SetBool, lambda _: (entered.set(), gate.wait(60), SetBool._response_class())[2])
    request = SetBool._request_class()

    async def talk() -> None:
        with pytest.raises(CallTimeout):
            await client.call("hang", SetBool, request, timeout_s=0.05)
        entered.clear()
        task = asyncio.ensure_future(client.call("hang", SetBool, request))
        await asyncio.to_thread(entered.wait, 60)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    run(talk())
    gate.set()
