"""Messages between nodes through a proxy that delays, splits, stalls, corrupts and cuts connections."""

from collections.abc import Iterator
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from pipros.node.service_link import ServiceFailed
from pipros.node.timings import NodeTimings
from pipros_tools.testing.faults.history import History
from pipros_tools.testing.faults.ros_proxy import FaultProxy
from tests.support.nodes import MakeNode
from tests.support.waiting import wait_until

LIMIT_S = 60.0
QUICK_RETRIES = NodeTimings(retry_longest_s=0.2, retry_refused_first_s=0.2)


@pytest.fixture
def proxy(master: Master) -> Iterator[FaultProxy]:
    with FaultProxy(master.uri, seed=16) as running:
        yield running


@pytest.fixture
def behind(proxy: FaultProxy) -> Iterator[Node]:
    """A node on the other side of the proxy."""
    environment = Environment(master_uri=proxy.uri)
    with Node("behind", environment=environment, timings=QUICK_RETRIES) as node:
        yield node


class Relay:
    """A node sends numbered texts to the node behind the proxy, which replies to each with its own text."""

    def __init__(self, near: Node, behind: Node, *, queue_size: int | None = 0) -> None:
        self.history = History()
        self.back = behind.advertise("back", String, queue_size=queue_size)
        self.far = behind.subscribe("chat", String, self._answer)
        self.near = near.subscribe("back", String, self._receive)
        self.there = near.advertise("chat", String, queue_size=queue_size)

    def _answer(self, message: Any) -> None:
        answer = self.history.next_text("behind", len(message.data))  # first: `wait` counts answers
        self.history.receive(message.data, "behind")
        self.back.publish(String(answer))

    def _receive(self, message: Any) -> None:
        self.history.receive(message.data, "near")

    def connect(self) -> None:
        wait_until(lambda: self.there.connection_count and self.back.connection_count, LIMIT_S)

    def say(self, size: int = 0) -> int:
        """Send the next message, with this number of characters; return its number."""
        text = self.history.next_text("near", size)
        self.there.publish(String(text))
        return int(text.split()[1])

    def wait(self, number: int) -> None:
        """Wait until a message and the reply to it have arrived."""

        def answered() -> bool:
            came, answer = self.history.last("near", "behind"), self.history.last("behind", "near")
            return came >= number and answer == self.history.sent("behind")

        wait_until(answered, LIMIT_S, lambda: f"no {number}; {self.counted()}")

    def say_until_one_comes(self) -> None:
        """Send messages until one is replied to: links may be reopened meanwhile."""
        before = self.history.last("behind", "near")

        def comes() -> bool:
            self.say()
            return self.history.last("behind", "near") > before

        wait_until(comes, LIMIT_S)

    def counted(self) -> dict[str, int]:
        """Return the counts of dropped messages and ended links of all four ends."""
        ends = [end.statistics() for end in (self.there, self.back, self.near, self.far)]
        return {key: sum(end[key] for end in ends) for key in ("dropped", "links_ended")}

    def problems(self) -> list[str]:
        counted = self.counted()
        return self.history.problems(counted=counted["dropped"], breaks=counted["links_ended"])


@pytest.fixture
def relay(make_node: MakeNode, behind: Node) -> Relay:
    relay = Relay(make_node("near", timings=QUICK_RETRIES), behind)
    relay.connect()
    return relay


@pytest.mark.parametrize(
    "faults",
    [
        {"delay_s": 0.02, "jitter_s": 0.02}, {"split_bytes": 3}, {"split_bytes": 1500, "jitter_s": 0.001},
        {"stall_every_bytes": 50_000, "stall_s": 0.05},
    ],
    ids=["late", "in small pieces", "in packets", "with pauses"],
)  # fmt: skip
def test_messages_arrive_once_and_in_order(proxy: FaultProxy, relay: Relay, faults: dict[str, float]) -> None:
    proxy.inject("topics", "nodes", "master", **faults)

    last = 0
    for number in range(300):
        last = relay.say(size=number % 50 * 20)
    relay.wait(last)

    assert (relay.history.problems(), relay.history.received) == ([], 600)


def test_large_messages_arrive_whole_in_pieces(proxy: FaultProxy, relay: Relay) -> None:
    proxy.inject(split_bytes=2000)

    relay.wait([relay.say(size=300_000) for _ in range(20)][-1])

    assert relay.history.problems() == []


def test_links_that_are_cut_repeatedly_lose_only_messages_in_transit(proxy: FaultProxy, relay: Relay) -> None:
    proxy.inject(cut_every_bytes=20_000, split_bytes=5000)

    while proxy.counts().cut < 20:
        relay.connect()
        for _ in range(20):
            relay.say(size=100)
        relay.say_until_one_comes()
    proxy.inject()
    relay.say_until_one_comes()

    assert relay.problems() == []
    assert relay.counted()["links_ended"] >= 20


def test_a_stalled_link_loses_the_counted_messages(make_node, proxy: FaultProxy, behind: Node) -> None:
    relay = Relay(make_node("near", timings=QUICK_RETRIES), behind, queue_size=5)
    relay.connect()
    relay.wait(relay.say())

    proxy.stall()
    last = [relay.say(size=100_000) for _ in range(200)][-1]
    proxy.resume()
    relay.wait(last)

    there = relay.there.statistics()
    lost = sum(gap.count for gap in relay.history.gaps if gap.sink == "behind")
    assert 0 < lost == there["dropped"] + relay.far.statistics()["dropped"]
    assert (relay.problems(), relay.counted()["links_ended"]) == ([], 0)


def test_a_link_that_ends_counts_its_queued_messages(relay: Relay, proxy: FaultProxy) -> None:
    relay.wait(relay.say())  # nothing is left in transit that would be taken for a message over the new link
    proxy.stall()
    for _ in range(500):  # more than the system's buffers can grow to
        relay.say(size=100_000)
    proxy.cut()
    proxy.resume()
    relay.connect()
    relay.say_until_one_comes()

    # The system and the proxy held the other published messages.
    wait_until(lambda: relay.there.statistics()["dropped"] > 10, LIMIT_S)
    assert relay.problems() == []


def test_corrupted_bytes_end_links_not_nodes(make_node: MakeNode, proxy: FaultProxy, relay: Relay) -> None:
    proxy.inject(corrupt_every_bytes=3000)
    rounds = 0
    while rounds < 30 or not relay.history.torn:
        rounds += 1
        assert rounds < 1000, "no message arrived with a changed text"
        for _ in range(20):
            relay.say(size=200)
        proxy.cut()  # a corrupted length makes the receiver wait for bytes that were never sent
        wait_until(lambda: relay.there.connection_count, LIMIT_S)
    proxy.inject()
    wait_until(lambda: not proxy.cut(), LIMIT_S)
    relay.say_until_one_comes()
    corrupted = proxy.counts().corrupted

    # TCPROS has no checksums: corrupted texts arrive, and are the only errors.
    torn = relay.history.torn
    assert len(torn) <= corrupted
    assert [line for line in relay.problems() if line not in torn and "lost" not in line] == []


def test_calls_over_a_bad_network_are_right_or_fail(make_node, behind: Node, proxy: FaultProxy) -> None:
    behind.serve("set", SetBool, lambda request: SetBool._response_class(request.data, str(request.data)))
    client = make_node("caller", timings=QUICK_RETRIES).client("set", SetBool)
    proxy.inject("services", cut_every_bytes=400, split_bytes=5, jitter_s=0.001)

    good = bad = 0
    for number in range(100):
        wanted = number % 2 == 0
        try:
            answer = client.call(SetBool._request_class(wanted), LIMIT_S)
        except ServiceFailed:
            bad += 1
        else:
            assert (answer.success, answer.message) == (wanted, str(wanted))
            good += 1
    proxy.inject("services")

    assert good > 10
    # A link that is cut before the request is sent fails no call.
    assert 5 < bad < proxy.counts("services").cut
    assert client.call(SetBool._request_class(True), LIMIT_S).success


def test_a_lost_master_interrupts_no_topic(make_node: MakeNode, proxy: FaultProxy, relay: Relay) -> None:
    proxy.refuse("master", "nodes")
    proxy.cut("master", "nodes")
    relay.wait(relay.say())

    proxy.refuse("master", "nodes", refuse=False)
    late = make_node("late", timings=QUICK_RETRIES)
    heard = History()
    late.subscribe("back", String, lambda message: heard.receive(message.data))

    def comes() -> bool:
        relay.say()
        return bool(heard.received)

    wait_until(comes, LIMIT_S)
    assert relay.problems() == []
