"""Callers of a node that may not be its master: their calls are verified, and not lost."""

from __future__ import annotations

import socket
from typing import Any

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.msg import load_message_class
from pipros.net.loop import BackgroundLoop
from pipros.net.master_client import MasterClient
from pipros.net.rpc_server import RpcServer
from pipros.net.this_machine import ThisMachineCaller
from pipros.node import Node
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode, listening_log
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")

STRANGER = ThisMachineCaller("198.51.100.7", 4711, "10.0.0.1", 11311)


def call(node: Node, method: str, *params: Any, caller: ThisMachineCaller = STRANGER) -> Any:
    """Return a node's response to a call over a connection of `caller`."""

    async def answer() -> Any:
        return node._started._rpc.call(method, params, caller=caller)

    return node._loop.run(answer(), 30)


@pytest.fixture
def unknown_master(monkeypatch: pytest.MonkeyPatch) -> None:
    """The master calls from an address that nodes do not know, as behind NAT."""
    monkeypatch.setattr(ThisMachineCaller, "is_here", False)
    monkeypatch.setattr(MasterClient, "addresses", ())


@pytest.mark.usefixtures("unknown_master")
def test_a_master_that_calls_from_an_unexpected_address_is_obeyed_nevertheless(make_node: MakeNode) -> None:
    log, lines = listening_log()
    inbox = Inbox()
    make_node("listener", log=log).subscribe("chat", String, inbox)
    for name in ("one", "two"):  # the second notification arrives while the first is being verified
        make_node(name).advertise("chat", String, latch=True).publish(String(name))
    assert {message.data for message in inbox.wait(2)} == {"one", "two"}
    [warning] = [line for line in lines if "publisherUpdate" in line]
    assert "of [/master] came from 127.0.0.1, which is an address of neither the master nor" in warning


def test_an_untrusted_caller_cannot_name_publishers(make_node: MakeNode, master: Master) -> None:
    listener, inbox = make_node("listener"), Inbox()
    listener.subscribe("chat", String, inbox)
    subscription = listener.endpoints.subscription("/chat")
    assert subscription is not None
    with socket.create_server(("127.0.0.1", 0)) as trap:
        uri = f"http://127.0.0.1:{trap.getsockname()[1]}/"
        assert call(listener, "publisherUpdate", "/master", "/chat", [uri]) == [
            1, "the master is queried instead", 0,
        ]  # fmt: skip
        calls = master._server.rpc.calls
        wait_until(lambda: calls["registerSubscriber"] == 2)  # one of them to subscribe
        make_node("talker").advertise("chat", String, latch=True).publish(String("good"))
        assert [message.data for message in inbox.wait()] == ["good"]
        assert subscription.attempts == 1  # to reach a publisher: the talker


def test_a_thousand_untrusted_calls_cost_the_master_only_a_few_calls(
    make_node: MakeNode, master: Master, constants: Constants
) -> None:
    log, lines = listening_log()
    constants(RECHECK_S=1000.0)
    listener = make_node("listener", log=log)
    listener.subscribe("chat", String, Inbox())
    for number in range(1000):
        call(listener, "publisherUpdate", f"/master{number}", "/chat", [])
        call(listener, "publisherUpdate", "/master", f"/topic{number}", [])
        call(listener, "paramUpdate", "/master", f"/parameter{number}", number)
    calls = master._server.rpc.calls
    wait_until(lambda: calls["registerSubscriber"] == 2)
    assert len(lines) == 2  # one for each kind of call


def test_an_untrusted_caller_cannot_change_the_cached_parameters_of_a_node(make_node: MakeNode) -> None:
    node, other = make_node("node"), make_node("other")
    other.params.set("/speed", {"limit": 1})
    assert node.params.get_cached("/speed/limit") == 1
    assert node.params.get_cached("/speed") == {"limit": 1}
    for key, value in (("/speed/limit", 99), ("/speed/limit/", 99), ("/speed", {"limit": 99}), ("/", {})):
        assert call(node, "paramUpdate", "/master", key, value)[0] == 1
        assert node.params.get_cached("/speed/limit") == 1
        assert node.params.get_cached("/speed") == {"limit": 1}


@pytest.mark.usefixtures("unknown_master")
def test_changes_of_parameters_arrive_from_an_unexpected_address_as_well(
    make_node: MakeNode, constants: Constants
) -> None:
    constants(RECHECK_S=0.01)
    node, other = make_node("node"), make_node("other")
    other.params.set("/speed", 1)
    assert node.params.get_cached("/speed") == 1
    for speed in (2, 3):
        other.params.set("/speed", speed)
        wait_until(lambda speed=speed: node.params.get_cached("/speed") == speed)


def test_an_untrusted_caller_cannot_end_a_node_and_gets_the_reason(
    make_node: MakeNode, master: Master
) -> None:
    node = make_node("node")
    node.advertise("chat", String)
    code, text, _ = call(node, "shutdown", "/rosnode", "user request")
    assert code == -1
    assert "only accepted from the master and from this node's machine, not from 198.51.100.7" in text
    calls = master._server.rpc.calls
    asked = calls["lookupNode"]
    wait_until(lambda: calls["lookupNode"] > asked)
    assert call(node, "getPid", "/me")[0] == 1
    assert not node.is_shutdown


@pytest.mark.usefixtures("unknown_master")
def test_a_replaced_node_shuts_down_even_if_the_caller_is_unknown(make_node: MakeNode) -> None:
    first = make_node("twin")
    first.advertise("chat", String)
    second = make_node("twin")
    second.advertise("chat", String)
    assert first.wait_for_shutdown(60)
    assert not second.is_shutdown


def test_the_master_is_trusted_at_its_last_addresses(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ThisMachineCaller, "is_here", False)
    node = make_node("node")
    assert call(node, "shutdown", "/master", "reason", caller=ThisMachineCaller("127.0.0.1"))[0] == -1
    node.advertise("chat", String)
    assert call(node, "shutdown", "/master", "reason", caller=ThisMachineCaller("127.0.0.1"))[0] == 1
    assert node.wait_for_shutdown(60)


def test_refusing_untrusted_callers_resolves_no_name(monkeypatch: pytest.MonkeyPatch) -> None:
    looked_up: list[Any] = []

    def look_up(host: Any, *more: Any, **options: Any) -> Any:
        looked_up.append(host)
        raise socket.gaierror(socket.EAI_AGAIN, "no name server answers")

    with Node(
        "node", environment=Environment(master_uri="http://robot.example:11311", ip="127.0.0.1")
    ) as node:
        monkeypatch.setattr(socket, "getaddrinfo", look_up)
        for _ in range(3):
            assert call(node, "publisherUpdate", "/master", "/chat", [])[0] == 1
            assert call(node, "paramUpdate", "/master", "/speed", 1)[0] == 1
        assert looked_up == []


JUNK: tuple[Any, ...] = (
    7, "junk", [], [1], [1, "junk"], {"code": 1}, ["1", "", []], [1, "", 7], [1, "", [7, ["x"]]],
)  # fmt: skip


@pytest.mark.parametrize("junk", JUNK, ids=map(str, JUNK))
def test_invalid_responses_of_a_master_have_no_effect_and_are_retried(junk: Any) -> None:
    """Once the master responds correctly, the node is registered."""
    lies = True
    calls: list[str] = []

    def answer(name: str, honest: list[Any]) -> Any:
        def method(*_: Any) -> Any:
            calls.append(name)
            return junk if lies else honest

        return method

    with socket.create_server(("127.0.0.1", 0)) as publisher:
        listed = [f"http://127.0.0.1:{publisher.getsockname()[1]}/"]
        loop = BackgroundLoop("junk master")
        loop.start()
        server = RpcServer(
            {
                "registerSubscriber": answer("registerSubscriber", [1, "", listed]),
                "registerPublisher": answer("registerPublisher", [1, "", []]),
                "unregisterSubscriber": answer("unregisterSubscriber", [1, "", 1]),
                "unregisterPublisher": answer("unregisterPublisher", [1, "", 1]),
                "lookupNode": answer("lookupNode", [-1, "unknown node", 0]),
            }
        )
        loop.run(server.start())
        log, lines = listening_log()
        environment = Environment(master_uri=f"http://127.0.0.1:{server.port}/")
        with Node("node", environment=environment, log=log) as node:
            node.subscribe("chat", String, Inbox())
            node.advertise("other", String)
            assert len(lines) == 2
            assert all("unable to register" in line for line in lines)
            wait_until(lambda: "lookupNode" in calls)
            lies = False
            publisher.settimeout(60)
            publisher.accept()[0].close()  # the node has received the list of publishers
        loop.run(server.stop())
        loop.stop()
