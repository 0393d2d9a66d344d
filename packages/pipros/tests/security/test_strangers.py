"""Callers that may not be the master or the user: verified, refused, and not lost."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Header, String

from pipros.basics.env import Environment
from pipros.basics.limits import Limits
from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.net.this_machine import ThisMachineCaller
from pipros.node import Node
from pipros.node.attempts import SLOW_FACTOR
from pipros.node.endpoints import CONNECTION_ATTEMPTS
from pipros.node.throttled_warnings import FULL, REPORT_S
from tests.support.constants import Constants
from tests.support.launch_parent import Parent, launch, start
from tests.support.network import FarNetwork, needs_network
from tests.support.nodes import Inbox, MakeNode, connected, listening_log, wait_until_connected
from tests.support.programs import make_programs
from tests.support.ros import RosSystem
from tests.support.slaves import Served, SilentSlave
from tests.support.users import STRANGER as OTHER_USER
from tests.support.users import needs_other_users
from tests.support.waiting import wait_until

# Callers of a node that may not be its master: their calls are verified, and not lost.


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


def test_a_thousand_untrusted_calls_cost_the_master_only_a_few_calls(make_node, master, constants) -> None:
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
def test_changes_of_parameters_arrive_from_an_unexpected_address_as_well(make_node, constants) -> None:
    constants(RECHECK_S=0.01)
    node, other = make_node("node"), make_node("other")
    other.params.set("/speed", 1)
    assert node.params.get_cached("/speed") == 1
    for speed in (2, 3):
        other.params.set("/speed", speed)
        wait_until(lambda speed=speed: node.params.get_cached("/speed") == speed)


def test_an_untrusted_caller_ends_no_node_and_gets_the_reason(make_node: MakeNode, master: Master) -> None:
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


def test_masters_are_trusted_at_last_addresses(make_node: MakeNode, monkeypatch: pytest.MonkeyPatch) -> None:
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
        honest = {
            "registerSubscriber": [1, "", listed], "registerPublisher": [1, "", []],
            "unregisterSubscriber": [1, "", 1], "unregisterPublisher": [1, "", 1],
            "lookupNode": [-1, "unknown node", 0],
        }  # fmt: skip
        log, lines = listening_log()
        with (
            Served({name: answer(name, value) for name, value in honest.items()}) as server,
            Node("node", environment=Environment(master_uri=server.api), log=log) as node,
        ):
            node.subscribe("chat", String, Inbox())
            node.advertise("other", String)
            assert len(lines) == 2
            assert all("unable to register" in line for line in lines)
            wait_until(lambda: "lookupNode" in calls)
            lies = False
            publisher.settimeout(60)
            publisher.accept()[0].close()  # the node has received the list of publishers


# Calls of other machines and other users that nodes, masters and launchers refuse.


SLEEPER = """
import rospy
rospy.init_node("sleeper")
rospy.Subscriber("chat", rospy.AnyMsg, print)
rospy.spin()
"""

# Without modules beyond the standard library's, which another user may not be able to read.
ORDER = """
import http.client, os, sys, xmlrpc.client, encodings.idna
port, user, text = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
os.setgid(user)
os.setuid(user)
try:
    print(xmlrpc.client.ServerProxy(f"http://127.0.0.1:{port}").launch(text))
except (OSError, http.client.HTTPException) as error:
    print("refused", type(error).__name__)
"""


@pytest.fixture
def far() -> Iterator[FarNetwork]:
    network = FarNetwork()
    yield network
    network.close()


@needs_network
def test_rosnode_kill_on_another_machine_reports_the_refusal(far: FarNetwork, ros: RosSystem) -> None:
    uri = f"http://{far.near}:{ros.port}"
    ros.pipros.environment["ROS_MASTER_URI"] = uri
    ros.master_uri = uri
    core = ros.pipros.start("roscore", "-p", str(ros.port), ROS_IP=far.near)
    core.wait_for(r"started core service \[/rosout\]")
    (ros.home / "sleeper.py").write_text(SLEEPER)
    sleeper = ros.pipros.start("python", "sleeper.py", ROS_IP=far.near)
    ros.wait_for_subscriber("/chat")

    killed = ros.pipros.run(*far.command("rosnode", "kill", "/sleeper"), ROS_IP=far.far)
    assert killed.returncode == 1
    assert killed.stderr[0].startswith(f"ERROR: /sleeper: http://{far.near}:")
    assert f"from this node's machine, not from {far.far}" in killed.stderr[0]
    assert killed.stderr[1:] == ["ERROR: Failed to kill:", " * /sleeper"]
    assert sleeper.is_running
    assert "shutdown of [/rosnode" in sleeper.wait_for(f"shutdown of .* came from {far.far}").string

    assert ros.pipros.run("rosnode", "kill", "/sleeper", ROS_IP=far.near).returncode == 0
    assert sleeper.wait() == 0


@needs_network
def test_a_master_lets_in_and_obeys_its_own_machine_by_each_address(far: FarNetwork) -> None:
    ended: list[str] = []
    master = Master(
        host="0.0.0.0",  # noqa: S104
        port=0,
        allow=["198.51.100.0/24"],
        on_shutdown=ended.append,
    )
    with master:
        refused = subprocess.run(
            far.command(
                sys.executable, "-c",
                f"import socket; print(socket.create_connection(('{far.near}', {master.port}), 10).recv(1))",
            ),
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )  # fmt: skip
        assert "ConnectionResetError" in refused.stderr or refused.stdout == "b''\n"
        client = MasterClient(f"http://{far.near}:{master.port}", "/test", timeout_s=30)
        assert (client.get_pid(), client.call("shutdown", "the end")) == (os.getpid(), 0)
        wait_until(lambda: ended)
        client.close()


@pytest.fixture
def parent() -> Iterator[Parent]:
    parent = Parent()
    yield parent
    parent.end()


@pytest.fixture
def package(ros: RosSystem) -> Path:
    folder = make_programs(ros.home / "programs", {"sleeper": "#!/bin/sh\nexec sleep 1000\n"})
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    return folder


@needs_other_users
@pytest.mark.usefixtures("package")
def test_another_user_cannot_have_a_roslaunch_child_start_programs(ros: RosSystem, parent: Parent) -> None:
    start(ros, parent)
    port = parent.child.uri.rpartition(":")[2].strip("/")
    text = '<launch><node pkg="programs" name="theirs" type="sleeper"/></launch>'

    def order(user: int) -> str:
        ran = subprocess.run(
            [sys.executable, "-c", ORDER, port, str(user), text],
            capture_output=True, text=True, timeout=60, check=True,
        )  # fmt: skip
        return ran.stdout

    assert order(OTHER_USER).startswith("refused ")
    assert launch(parent, ("ours", "sleeper"))[0] == 1  # so the first one was the other
    assert "has already launched its nodes" in order(0)


# Forged lists of publishers from a peer or master: the real publishers in them are connected.


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


def test_hosts_that_do_not_answer_keep_no_publisher_waiting(make_node, silent, constants: Constants) -> None:
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


def test_publishers_beyond_the_limit_are_left_out_and_logged(make_node, constants: Constants) -> None:
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


def test_odd_failures_are_logged(make_node: MakeNode, master: Master, monkeypatch) -> None:
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
def test_an_impossible_address_is_reported_and_tried_again(make_node, host, port: int, reason: str) -> None:
    log, lines = listening_log()
    listener, talker = make_node("listener", log=log), make_node("talker")
    subscriber = listener.subscribe("chat", String, Inbox())
    talker.advertise("chat", String)
    wait_until_connected(subscriber)
    answers: list[Any] = [["TCPROS", host, port]]
    with Served({"requestTopic": lambda *_: [1, "", answers[-1]]}) as server:
        tell(listener, [talker.uri, server.api])
        wait_until(lambda: any(reason in line for line in lines))
        answers.append(["TCPROS", "127.0.0.1", talker.endpoints.port])
        wait_until(lambda: len(subscriber.subscription.links) == 2)


@pytest.mark.parametrize(("stamp", "seq"), [(2**32 - 1, 2), (0, 2**31 + 5), (1, 2**32 - 1)])
def test_stamps_and_numbers_of_a_publisher_do_not_end_the_link_that_is_measured(
    make_node: MakeNode, stamp: int, seq: int
) -> None:
    log, lines = listening_log()
    listener, watcher, inbox, figures = make_node("listener", log=log), make_node("watcher"), Inbox(), Inbox()
    listener.enable_statistics()
    watcher.subscribe("/statistics", "rosgraph_msgs/TopicStatistics", figures)
    publisher = connected(make_node("talker"), listener, "chat", PoseStamped, inbox)
    sequence = [1]

    def publish() -> list[Any]:
        publisher.publication.encoder.sequence = (sequence[0] - 1) % 2**32
        message = PoseStamped(header=Header())
        message.header.stamp.secs = stamp
        publisher.publish(message)
        sequence[0] = seq if sequence[0] == 1 else 1
        return figures.messages

    wait_until(publish, timeout_s=60)
    assert publisher.connection_count == 1
    assert lines == []
