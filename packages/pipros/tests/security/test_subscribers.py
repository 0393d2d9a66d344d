"""Slow, stuck and talkative subscribers, and the memory and timers that peers use."""

import contextlib
import re
import struct
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from std_msgs.msg import String, UInt8MultiArray

from actionlib.msg import TestActionGoal as ActionGoal
from actionlib.msg import TestActionResult as ActionResult
from pipros.basics.env import Environment
from pipros.basics.limits import Limits
from pipros.master.master import Master
from pipros.node import Node
from tests.support.constants import Constants
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.processes import Process, Processes
from tests.support.ros import RosSystem
from tests.support.rosbridge import RosbridgeClient
from tests.support.subscribers import dripping_subscriber, raw_subscriber
from tests.support.waiting import wait_until

# The cost of slow and stuck subscribers for their publisher and for other subscribers.


LARGE = UInt8MultiArray(data=b"x" * 8_000_000)
COUNT = 8


def in_thread(function: Any, *args: Any) -> threading.Thread:
    thread = threading.Thread(target=function, args=args, daemon=True)
    thread.start()
    return thread


@pytest.mark.parametrize("queue_size", [None, 0, 1])
def test_a_subscriber_that_reads_slowly_costs_one_wait(make_node: MakeNode, queue_size: int | None) -> None:
    talker, listener, inbox = make_node("talker", limits=Limits(stall_s=1.0)), make_node("listener"), Inbox()
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=queue_size)
    with dripping_subscriber(talker, "/chat"):
        listener.subscribe("chat", UInt8MultiArray, inbox)
        wait_until_connected(publisher, 2)

        [slow] = [peer.link for peer in publisher.publication.links if peer.caller_id == "/drip"]
        for number in range(1, COUNT + 1):
            published = in_thread(publisher.publish, LARGE)
            wait_until(lambda thread=published: not thread.is_alive(), what="the end of publish()")  # type: ignore[misc]
            inbox.wait(number)
            assert not slow.is_waited_for


def test_many_slow_subscribers_together_cost_one_wait(make_node: MakeNode) -> None:
    talker = make_node("talker", limits=Limits(stall_s=1.0))
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=None)
    with contextlib.ExitStack() as slow:
        for number in range(30):
            slow.enter_context(raw_subscriber(talker, "/chat", f"/slow{number}"))
        wait_until_connected(publisher, 30)

        began = time.monotonic()
        publisher.publish(LARGE)

        assert time.monotonic() - began < 20  # one after the other would take 30


def test_others_get_a_message_while_publish_waits_for_a_slow_one(make_node: MakeNode) -> None:
    talker, listener, inbox = make_node("talker", limits=Limits(stall_s=60)), make_node("listener"), Inbox()
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=None)
    with raw_subscriber(talker, "/chat"):
        wait_until_connected(publisher, 1)  # the slow one is first
        listener.subscribe("chat", UInt8MultiArray, inbox)
        wait_until_connected(publisher, 2)

        published = in_thread(publisher.publish, LARGE)

        inbox.wait(1)
        assert published.is_alive()
    wait_until(lambda: not published.is_alive(), what="publish() after the slow one has left")


def test_publish_waits_again_for_a_subscriber_that_has_caught_up(make_node: MakeNode) -> None:
    talker = make_node("talker", limits=Limits(stall_s=0.2))
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=None)
    with raw_subscriber(talker, "/chat") as sock:
        wait_until_connected(publisher, 1)
        publisher.publish(LARGE)
        link = publisher.publication.links[0].link
        assert not link.is_waited_for

        received = len(sock.recv(2048))
        assert not link.is_waited_for

        while received < len(LARGE.data):
            received += len(sock.recv(1 << 20))
        wait_until(lambda: link.is_waited_for)


@pytest.mark.parametrize("queue_size", [0, 1000])
def test_messages_that_wait_for_a_subscriber_have_a_limit_in_bytes(make_node, queue_size: int) -> None:
    talker = make_node("talker", limits=Limits(queue_bytes=1_000_000))
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=queue_size)
    with raw_subscriber(talker, "/chat") as sock:
        wait_until_connected(publisher, 1)
        for number in range(200):
            publisher.publish(UInt8MultiArray(data=struct.pack("<I", number) * 25_000))
        sent = publisher.statistics()
        assert sent["dropped"] > 100

        received = bytearray()
        newest = struct.pack("<I", 199) * 25_000
        while newest not in received[-len(newest) :]:
            received += sock.recv(1 << 20)

        # One frame, and the bytes in the socket buffer, were sent; ten messages were queued.
        assert publisher.statistics()["frames"] - sent["frames"] <= 11


# Subscribers that send data on a topic link.


def test_a_subscriber_that_keeps_sending_is_disconnected(make_node: MakeNode) -> None:
    log, lines = listening_log()
    talker = make_node("talker", log=log)
    publisher = talker.advertise("chat", String)
    with raw_subscriber(talker, "/chat", "/flood\x1b[31m") as sock:
        wait_until_connected(publisher)
        with contextlib.suppress(OSError):  # it is closed meanwhile
            while publisher.connection_count:
                sock.sendall(bytes(1024))
        wait_until(lambda: publisher.connection_count == 0)
    found = wait_until(lambda: [line for line in lines if "4096 bytes after its header" in line])
    assert r"subscriber [/flood\x1b[31m] of [/chat]" in found[0]


def test_a_subscriber_that_sends_few_bytes_keeps_its_link(make_node: MakeNode, constants: Constants) -> None:
    constants(SUBSCRIBER_BYTES=100)
    talker = make_node("talker")
    publisher = talker.advertise("chat", String)
    with raw_subscriber(talker, "/chat") as sock:
        wait_until_connected(publisher)
        sock.sendall(bytes(100))
        publisher.publish(String("still here"))
        received = b""
        while not received.endswith(b"still here"):
            received += sock.recv(1024)
        sock.sendall(bytes(1))
        wait_until(lambda: publisher.connection_count == 0)


# Memory that a bridge returns to the system when a client with large messages has left.


MIB = 1024 * 1024
LARGE_BYTES = 8 * MIB


def memory_bytes(pid: int) -> int:
    found = re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text())
    return int(found[1]) * 1024


def test_what_a_client_made_the_server_use_is_returned_after_it_has_left(ros: RosSystem) -> None:
    ros.serve_master()
    server = ros.pipros.start("pipros", "serve", "--port", "0", "--control")
    url = server.wait_for(r"ws://\S+:\d+")[0]
    with RosbridgeClient(url) as first:  # everything is imported
        assert first.call("/none")["result"] is False
    before = memory_bytes(server.pid)
    most = before
    with RosbridgeClient(url) as large:
        large.send("advertise", topic="/a", type="std_msgs/String")
        for _ in range(5):
            large.send("publish", topic="/a", msg={"data": "x" * LARGE_BYTES})
            large.call("/none")
            most = max(most, memory_bytes(server.pid))
    assert most > before + LARGE_BYTES
    wait_until(lambda: memory_bytes(server.pid) < before + LARGE_BYTES // 2)


# Peers cannot make the goals of an action server grow without limit, nor its timer spin.


SERVER = """
import actionlib, rospy
from actionlib.msg import TestAction

rospy.init_node('server')
timer = rospy.Timer
def observed(period, *arguments, **options):
    print('period', period.to_nsec(), flush=True)
    return timer(period, *arguments, **options)
rospy.Timer = observed
server = actionlib.ActionServer('go', TestAction, lambda goal: goal.set_accepted(), auto_start=False)
server.start()
print('ready', flush=True)
rospy.spin()
"""


def start_server(processes: Processes, tmp_path: Path, master: Master) -> Process:
    script = tmp_path / "server.py"
    script.write_text(SERVER)
    server = processes.start(
        sys.executable, script, environment={"ROS_MASTER_URI": master.uri, "PIPROS_LIMITS": "goals=5"}
    )
    server.wait_for("ready")
    return server


def test_goals_and_early_cancels_are_limited(processes: Processes, tmp_path: Path, master: Master) -> None:
    server = start_server(processes, tmp_path, master)
    results: dict[str, int] = {}
    statuses: list[Any] = []

    def keep(result: Any) -> None:
        results[result.status.goal_id.id] = result.status.status

    with Node("peer", environment=Environment(master_uri=master.uri)) as node:
        result = node.subscribe("/go/result", ActionResult, keep)
        node.subscribe("/go/status", GoalStatusArray, lambda array: statuses.append(array.status_list))
        cancels = node.advertise("/go/cancel", GoalID, queue_size=100)
        goals = node.advertise("/go/goal", ActionGoal, queue_size=100)
        wait_until_connected(cancels)
        wait_until_connected(goals)
        wait_until_connected(result)
        for number in range(20):
            cancels.publish(GoalID(id=f"unknown {number}"))
        wait_until(
            lambda: any(len(each) == 5 for each in statuses), 60, lambda: f"{statuses} {server.output}"
        )
        for number in range(20):
            goals.publish(ActionGoal(goal_id=GoalID(id=f"goal {number}")))
        wait_until(lambda: len(results) == 15, 60, lambda: f"{results} {server.output}")
        wait_until(
            lambda: [each.goal_id.id for each in statuses[-1]] == [f"goal {number}" for number in range(5)],
            60,
        )

    assert results == {f"goal {number}": GoalStatus.REJECTED for number in range(5, 20)}
    assert max(map(len, statuses)) == 5
    assert server.output.count("the limit is 5 (goals in PIPROS_LIMITS)") == 1


def test_an_absurd_status_frequency_is_limited(processes: Processes, tmp_path: Path, master: Master) -> None:
    with Node("peer", environment=Environment(master_uri=master.uri)) as node:
        node.master.set_param("/actionlib_status_frequency", 1e12)
        server = start_server(processes, tmp_path, master)
    server.wait_for("period 1000000$")
