"""The cost of slow and stuck subscribers for their publisher and for other subscribers."""

from __future__ import annotations

import contextlib
import struct
import threading
import time
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.msg import load_message_class
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.subscribers import dripping_subscriber, raw_subscriber
from tests.support.waiting import wait_until

UInt8MultiArray: Any = load_message_class("std_msgs/UInt8MultiArray")
LARGE = UInt8MultiArray(data=b"x" * 8_000_000)
COUNT = 8


def in_thread(function: Any, *args: Any) -> threading.Thread:
    thread = threading.Thread(target=function, args=args, daemon=True)
    thread.start()
    return thread


@pytest.mark.parametrize("queue_size", [None, 0, 1])
def test_a_subscriber_that_reads_slowly_costs_a_single_wait(
    make_node: MakeNode, queue_size: int | None
) -> None:
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
def test_the_messages_that_wait_for_one_subscriber_have_a_limit_in_bytes(
    make_node: MakeNode, queue_size: int
) -> None:
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
