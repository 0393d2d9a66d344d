"""Messages that a bridge keeps for later subscribers count as memory of the client that published them."""

import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.errors import LimitExceeded
from pipros.basics.limits import Limits
from pipros.node import Node
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.rosbridge.filling import Filler
from pipros_bridges.rosbridge.publishing import SharedPublishers
from pipros_bridges.rosbridge.shared_publisher import MESSAGE_BYTES
from pipros_bridges.shares import ClientShares, ServerShares
from pipros_server.act_gate import ActGate
from tests.support.constants import Constants
from tests.support.node_fixtures import make_node as make_node
from tests.support.node_fixtures import master as master
from tests.support.nodes import MakeNode
from tests.support.rosbridge import RosbridgeClient, rosbridge_server

MIB = 1024 * 1024
TABLE = BridgeLimits(bridge_queue_bytes=MIB, bridge_message_bytes=MIB)
LIMITS = Limits(tables=(TABLE,))
CLIENT_BYTES = 15 * MIB


@pytest.fixture(autouse=True)
def small_limits(constants: Constants) -> None:
    constants(BRIDGE_PARSED_BYTES=10 * MIB, BRIDGE_CLIENT_BYTES=CLIENT_BYTES, BRIDGE_TOTAL_BYTES=60 * MIB)


class FakePublisher:
    """A publisher of a topic with any number of subscribers."""

    def __init__(self, topic: str, has_subscribers: Callable[[], bool]) -> None:
        self.topic = topic
        self.published: list[Any] = []
        self.is_registered = True
        kind = SimpleNamespace(_type="std_msgs/String")
        self.publication = SimpleNamespace(listeners=[], message_class=kind)
        self._has_subscribers = has_subscribers

    @property
    def connection_count(self) -> int:
        return int(self._has_subscribers())

    def publish(self, message: Any) -> None:
        self.published.append(message)

    def unregister(self) -> None:
        self.is_registered = False


class Server:
    """The publishers of a bridge, on a node without sockets. `pass_time` calls what is due later."""

    def __init__(self) -> None:
        self.shares = ServerShares(LIMITS)
        self.has_subscribers = True
        self.made: list[FakePublisher] = []
        self._later: list[Callable[[], object]] = []
        master = SimpleNamespace(get_published_topics=list)
        node: Any = SimpleNamespace(
            limits=LIMITS, advertise=self._advertise, resolve=lambda name: name, master=master,
            on_shutdown=lambda _: None, remove_shutdown_hook=lambda _: None,
        )  # fmt: skip
        self.publishers = SharedPublishers(
            node, Filler(lambda: 0), lambda _: None, lambda _, function: self._later.append(function), 0,
            ActGate(node),
        )  # fmt: skip

    def _advertise(self, topic: str, *_: Any, **__: Any) -> FakePublisher:
        self.made.append(FakePublisher(topic, lambda: self.has_subscribers))
        return self.made[-1]

    def pass_time(self) -> None:
        later, self._later = self._later, []
        for function in later:
            function()

    @property
    def registered(self) -> list[str]:
        return [each.topic for each in self.made if each.is_registered]


class Client:
    def __init__(self, server: Server) -> None:
        self.shares: ClientShares = server.shares.client()
        self._publishers = server.publishers

    def advertise(self, topic: str, *, latch: bool = True) -> None:
        self._publishers.advertise(
            self, topic, "std_msgs/String", latch=latch, queue_size=1, shares=self.shares
        )

    def publish(self, topic: str, size: int, parsed: int = 0) -> None:
        self._publishers.publish(
            self,
            topic,
            {"data": "x" * (size - 4)},  # which the length of the text precedes
            latch=None,
            queue_size=1,
            shares=self.shares,
            end_parsing=lambda: parsed,
        )

    def leave(self, *topics: str) -> None:
        self.shares.close()
        for topic in topics:
            self._publishers.release(self, topic)


def latch_all_that_fits(client: Client, count: int = 30) -> list[str]:
    """Latch a message of 1 MiB on each of some topics. Return the topics before the first that is refused."""
    latched = []
    for number in range(count):
        client.advertise(f"/t{number}")
        latched.append(f"/t{number}")
        try:
            client.publish(f"/t{number}", MIB)
        except LimitExceeded:
            break
    return latched


def test_latched_messages_count_until_their_client_exceeds_its_share() -> None:
    server = Server()
    client = Client(server)
    topics = latch_all_that_fits(client)

    assert len(topics) == 10
    assert client.shares.memory.used == 9 * (MIB + MESSAGE_BYTES)
    with pytest.raises(LimitExceeded, match=r"latched messages of this client .*the limit is 10485760 bytes"):
        client.publish(topics[-1], MIB)
    assert server.made[-1].published == []
    client.publish("/t0", MIB // 2)  # it replaces the previous one
    client.publish("/t0", MIB)
    client.publish("/t1", MIB // 4)
    client.publish(topics[-1], MIB // 2)
    assert [len(each.published) for each in server.made] == [3, 2, *[1] * 8]


def test_a_latched_message_counts_as_much_as_its_parsed_values() -> None:
    server = Server()
    client = Client(server)
    client.advertise("/list")
    client.publish("/list", 100, parsed=5 * MIB)
    assert client.shares.memory.used == 5 * MIB + MESSAGE_BYTES


def test_messages_that_are_not_latched_cost_nothing() -> None:
    server = Server()
    client = Client(server)
    client.advertise("/plain", latch=False)
    for _ in range(50):
        client.publish("/plain", MIB)
    assert (client.shares.memory.peak, len(server.made[0].published)) == (0, 50)


def test_messages_before_the_first_subscriber_count_until_they_are_published() -> None:
    server = Server()
    server.has_subscribers = False
    client = Client(server)
    for number in range(4):
        client.advertise(f"/t{number}", latch=False)
        for _ in range(3):
            client.publish(f"/t{number}", MIB)

    assert client.shares.memory.used == 9 * (MIB + MESSAGE_BYTES)
    assert [len(each.published) for each in server.made] == [0, 0, 0, 3]  # the last ones cannot wait
    server.pass_time()
    assert client.shares.memory.used == 0
    assert [len(each.published) for each in server.made] == [3, 3, 3, 3]


def test_the_newest_message_that_waited_stays_counted_on_a_latched_topic() -> None:
    server = Server()
    server.has_subscribers = False
    client = Client(server)
    client.advertise("/t")
    for size in (100, 200, 300):
        client.publish("/t", size)
    server.pass_time()
    assert client.shares.memory.used == 300 + MESSAGE_BYTES


def test_another_client_of_the_topic_pays_for_a_client_that_left() -> None:
    server = Server()
    first, second = Client(server), Client(server)
    for client in (first, second):
        client.advertise("/shared")
    first.publish("/shared", MIB)
    assert second.shares.memory.used == 0

    first.leave("/shared")
    assert second.shares.memory.used == MIB + MESSAGE_BYTES

    second.leave("/shared")
    assert server.shares.memory.used == server.shares.left_behind.used == MIB + MESSAGE_BYTES
    server.pass_time()
    assert (server.shares.memory.used, server.registered) == (0, [])


def test_clients_that_come_and_go_leave_no_more_than_one_share_behind() -> None:
    server = Server()
    for _ in range(20):
        client = Client(server)
        client.leave(*latch_all_that_fits(client))
        assert server.shares.memory.used <= CLIENT_BYTES
    assert len(server.registered) <= 15
    server.pass_time()
    assert (server.shares.memory.used, server.registered) == (0, [])


def test_a_rosbridge_client_that_latches_too_much_is_told(make_node: MakeNode) -> None:
    node: Node = make_node("bridge", limits=LIMITS)
    with rosbridge_server(node) as url, RosbridgeClient(url) as client:
        for number in range(20):
            client.send("advertise", topic=f"/t{number}", type="std_msgs/String", latch=True)
            client.socket.send(
                json.dumps({"op": "publish", "topic": f"/t{number}", "msg": {"data": "x" * 900_000}})
            )
        text = client.wait_for("status")["msg"]
        assert "the latched messages of this client need too much memory" in text
        assert "the limit is 10485760 bytes" in text
