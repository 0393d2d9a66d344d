"""Forged lists of publishers from a peer or master: the real publishers in them are connected."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_client import RpcClient
from pipros.net.rpc_server import RpcServer
from pipros.node import Node
from pipros.node.attempts import SLOW_FACTOR
from pipros.node.endpoints import CONNECTION_ATTEMPTS
from pipros.node.throttled_warnings import FULL, REPORT_S
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.slaves import SilentSlave
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")


@pytest.fixture
def silent() -> Iterator[SilentSlave]:
    slave = SilentSlave()
    yield slave
    slave.stop()


def tell(node: Node, uris: list[Any]) -> None:
    with RpcClient(node.uri, timeout_s=30) as peer:
        assert peer.call("publisherUpdate", "/master", "/chat", uris)[0] == 1


def attempts_under_way(node: Node) -> int:
    return node.endpoints.attempts.under_way


def test_thousands_of_dead_publishers_are_tried_a_few_at_a_time_and_logged_once(make_node: MakeNode) -> None:
    log, lines = listening_log()
    listener, talker = make_node("listener", log=log), make_node("talker")
    subscriber = listener.subscribe("chat", String, Inbox())
    most, began = [0], time.monotonic()

    tell(listener, [f"http://127.0.0.1:1/{number}" for number in range(10_000)])
    while subscriber.subscription.attempts < 200:
        most[0] = max(most[0], attempts_under_way(listener))
    tell(listener, [*(f"http://127.0.0.1:1/{number}" for number in range(1_000)), talker.uri])
    talker.advertise("chat", String)

    wait_until_connected(subscriber)
    # Of 10,000. On a busy machine attempts are slow, and each slow one lets another one start.
    assert most[0] <= CONNECTION_ATTEMPTS * (1 + SLOW_FACTOR)
    logged = [line for line in lines if "cannot receive" in line or "publishers" in line]
    periods = 1 + int((time.monotonic() - began) / REPORT_S)  # more than one on a busy machine
    assert len(logged) <= periods * (FULL + 1)
    with RpcClient(listener.uri, timeout_s=30) as peer:
        assert peer.call("getPid", "/friend")[0] == 1


def test_hosts_that_do_not_answer_keep_no_publisher_waiting(
    make_node: MakeNode, silent: SilentSlave, constants: Constants
) -> None:
    constants(CONNECTION_ATTEMPTS=4)
    listener, talker = make_node("listener"), make_node("talker")
    subscriber = listener.subscribe("chat", String, Inbox())
    hang = [f"{silent.api}{number}" for number in range(40)]

    tell(listener, hang)
    wait_until(lambda: len(silent.connections) >= 4)
    talker.advertise("chat", String)
    tell(listener, [*hang, talker.uri])

    wait_until_connected(subscriber)
    assert attempts_under_way(listener) <= 4 + 40


def test_publishers_beyond_the_limit_are_skipped_and_logged(
    make_node: MakeNode, constants: Constants
) -> None:
    log, lines = listening_log()
    constants(PUBLISHERS_PER_TOPIC=5)
    listener = make_node("listener", log=log)
    talker = make_node("talker")
    talker.advertise("chat", String)
    subscriber = listener.subscribe("chat", String, Inbox())
    wait_until_connected(subscriber)

    tell(listener, [*(f"http://127.0.0.1:1/{number}" for number in range(50)), talker.uri])

    wait_until(lambda: "[/chat] has 51 publishers; the limit is 5" in lines)
    assert subscriber.connection_count == 1


def test_links_beyond_the_limit_are_not_made(make_node: MakeNode) -> None:
    log, lines = listening_log()
    listener = make_node("listener", log=log, limits=Limits(incoming_links=2))
    talkers = [make_node(f"talker_{number}") for number in range(3)]
    for talker in talkers:
        talker.advertise("chat", String)
    subscriber = listener.subscribe("chat", String, Inbox())
    wait_until_connected(subscriber, 2)
    wait_until(lambda: any("as many connections as its limits allow" in line for line in lines))
    assert subscriber.connection_count == 2

    linked = {peer.uri for peer in subscriber.subscription.links}
    next(talker for talker in talkers if talker.uri in linked).shutdown("room for another")
    wait_until(lambda: {peer.uri for peer in subscriber.subscription.links} - linked)


@pytest.mark.parametrize("value", [[1, 2.5, None, ["http://127.0.0.1:1/"], {"a": 1}], [""], ["http://[::1"]])
def test_an_invalid_list_of_publishers_ends_no_link(make_node: MakeNode, value: list[Any]) -> None:
    listener, inbox = make_node("listener"), Inbox()
    subscription = listener.subscribe("chat", String, inbox).subscription
    loop_failures: list[Any] = []
    listener._loop.asyncio.set_exception_handler(lambda _, context: loop_failures.append(context))
    listener._loop.call(subscription.update_publishers, value)
    publisher = make_node("talker").advertise("chat", String)
    wait_until_connected(publisher)
    publisher.publish(String("good"))
    assert inbox.wait()[0].data == "good"
    assert loop_failures == []


def test_an_unexpected_failure_is_logged(
    make_node: MakeNode, master: Master, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, lines = listening_log()
    listener = make_node("listener", log=log)
    subscription = listener.subscribe("chat", String, Inbox()).subscription

    async def fail(_: str) -> Any:
        raise ZeroDivisionError

    monkeypatch.setattr(subscription._dialer, "_request", fail)
    tell(listener, ["http://127.0.0.1:1/"])
    wait_until(lambda: "unexpected error for a publisher of [/chat]" in lines)


@pytest.mark.parametrize(
    ("host", "port", "reason"),
    [
        ("127.0.0.1", 70_000, "impossible address 127.0.0.1:70000: a port must be between 1 and 65535"),
        ("127.0.0.1", -1, "impossible address 127.0.0.1:-1: a port must be between 1 and 65535"),
        ("a..b", 1234, "cannot reach a..b:1234: "),
    ],
)
def test_an_impossible_address_is_reported_and_tried_again(
    make_node: MakeNode, host: str, port: int, reason: str
) -> None:
    log, lines = listening_log()
    listener, talker = make_node("listener", log=log), make_node("talker")
    subscriber = listener.subscribe("chat", String, Inbox())
    talker.advertise("chat", String)
    wait_until_connected(subscriber)
    answers: list[Any] = [["TCPROS", host, port]]
    server = RpcServer({"requestTopic": lambda *_: [1, "", answers[-1]]})
    loop = BackgroundLoop("publisher with an impossible address")
    loop.start()
    loop.run(server.start())
    try:
        tell(listener, [talker.uri, f"http://127.0.0.1:{server.port}/"])
        wait_until(lambda: any(reason in line for line in lines))
        answers.append(["TCPROS", "127.0.0.1", talker.endpoints.port])
        wait_until(lambda: len(subscriber.subscription.links) == 2)
    finally:
        loop.run(server.stop())
        loop.stop()


@pytest.mark.parametrize(("stamp", "seq"), [(2**32 - 1, 2), (0, 2**31 + 5), (1, 2**32 - 1)])
def test_stamps_and_numbers_of_a_publisher_do_not_end_the_link_that_is_measured(
    make_node: MakeNode, stamp: int, seq: int
) -> None:
    header_type: Any = load_message_class("std_msgs/Header")
    pose: Any = load_message_class("geometry_msgs/PoseStamped")
    log, lines = listening_log()
    listener, watcher, inbox, figures = make_node("listener", log=log), make_node("watcher"), Inbox(), Inbox()
    listener.enable_statistics()
    watcher.subscribe("/statistics", load_message_class("rosgraph_msgs/TopicStatistics"), figures)
    listener.subscribe("chat", pose, inbox)
    publisher = make_node("talker").advertise("chat", pose)
    wait_until_connected(publisher)
    sequence = [1]

    def publish() -> list[Any]:
        publisher.publication.encoder.sequence = (sequence[0] - 1) % 2**32
        message = pose(header=header_type())
        message.header.stamp.secs = stamp
        publisher.publish(message)
        sequence[0] = seq if sequence[0] == 1 else 1
        return figures.messages

    wait_until(publish, timeout_s=60)
    assert publisher.connection_count == 1
    assert lines == []
