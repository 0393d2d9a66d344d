"""Reported faults of topics in ros_comm."""

import gc
import os
import socket
import struct
import sys
import threading
import weakref
from typing import Any

import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import String, UInt8MultiArray

from pipros.net.master_client import MasterClient
from pipros.net.timings import LinkTimings
from pipros.net.workers import KEPT_IDLE
from pipros.node import Node
from pipros.node.timings import NodeTimings
from pipros.wire.header import HeaderReader, encode_header
from tests.support.nodes import Inbox, MakeNode, listening_log, wait_until_connected
from tests.support.waiting import wait_until

# ros_comm#373, #557, #432, #1362: with five subscribers, or a queue_size, 100 Hz fell to 5 or 10. The
# causes were a sleeping queue, a message that was serialised for each subscriber, and Nagle's algorithm,
# which delays small messages.


QUEUE_SIZES = [None, 0, 1, 10, 1000]


class RawSubscriber:
    """A socket that has subscribed to `/chat`."""

    def __init__(self, node: Node) -> None:
        self.sock = socket.create_connection(("127.0.0.1", node.endpoints.port), 10)
        self.sock.sendall(encode_header({"topic": "/chat", "md5sum": "*", "callerid": "/raw"}))
        reader = HeaderReader()
        while reader.feed(self.sock.recv(16)) is None:
            pass
        assert not reader.rest

    def take_now(self, count: int) -> bytes:
        """Return this number of bytes that have arrived; raise BlockingIOError if they have not."""
        return self.sock.recv(count, socket.MSG_DONTWAIT | socket.MSG_WAITALL)

    def close(self) -> None:
        self.sock.close()


@pytest.mark.parametrize("queue_size", QUEUE_SIZES)
def test_five_subscribers_get_messages_serialised_once(make_node: MakeNode, queue_size: int | None) -> None:
    talker, listeners = make_node("talker"), [make_node(f"listener{number}") for number in range(5)]
    inboxes = [Inbox() for _ in listeners]
    for listener, inbox in zip(listeners, inboxes, strict=True):
        listener.subscribe("chat", UInt8MultiArray, inbox)
    encoded: list[object] = []

    class Counted(UInt8MultiArray):
        """The same type, which records each serialisation."""

        __slots__ = ()

        def _to_buffers(self) -> list[bytes | memoryview]:
            encoded.append(self)
            return super()._to_buffers()  # type: ignore[no-any-return]

    publisher = talker.advertise("chat", Counted, queue_size=queue_size)
    wait_until_connected(publisher, 5)
    for number in range(100):
        publisher.publish(Counted(data=bytes([number])))
        for inbox in inboxes:
            inbox.wait(number + 1)
    for inbox in inboxes:
        assert [message.data[0] for message in inbox.messages] == list(range(100))
    assert len(encoded) == 100


@pytest.mark.parametrize("queue_size", QUEUE_SIZES)
@pytest.mark.parametrize("size", [1, 1000, 1449, 5000])
def test_publish_returns_when_a_message_is_sent(make_node, queue_size: int | None, size: int) -> None:
    talker = make_node("talker")
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=queue_size)
    raw = RawSubscriber(talker)
    wait_until_connected(publisher)
    for number in range(20):
        body = struct.pack("<III", 0, 0, size) + bytes([number]) * size
        publisher.publish(UInt8MultiArray(data=bytes([number]) * size))
        assert raw.take_now(len(body) + 4) == struct.pack("<I", len(body)) + body
    raw.close()


# ros_comm#536, #1901: with queue_size=1 a slow callback saw old images, unless buff_size was guessed.


@pytest.mark.parametrize("size", [100, 20_000, 300_000])
def test_queue_size_1_is_the_newest_message_whatever_its_size(make_node: MakeNode, size: int) -> None:
    every_callback_is_slow = NodeTimings(links=LinkTimings(slow_delivery_s=0.0))
    camera, detector = make_node("camera"), make_node("detector", timings=every_callback_is_slow)
    seen: list[int] = []
    entered, gate = threading.Event(), threading.Event()

    def detect(image: Any) -> None:
        seen.append(image.data[0])
        entered.set()
        gate.wait(60)

    detector.subscribe("image", Image, detect, queue_size=1)
    publisher = camera.advertise("image", Image, queue_size=1)
    wait_until_connected(publisher)
    publisher.publish(Image(data=bytes([0]) * size))
    assert entered.wait(60)
    for number in range(1, 20):
        publisher.publish(Image(data=bytes([number]) * size))
    gate.set()
    wait_until(lambda: seen[-1] == 19)
    assert len(seen) <= 4  # those in a full socket, and the newest


# ros_comm#222: a topic is listed, but no message arrives, and no tool says why. Requested in 2013: report
# that a publisher cannot be reached, because its host name is unknown here.


@pytest.mark.parametrize(
    ("api", "advice"),
    [
        ("http://no-such-robot.invalid:1234/", "set ROS_IP on the node's machine"),
        ("http://127.0.0.1:1/", "Connection refused. That address is local: the node has ended"),
    ],
    ids=["unknown host", "closed port"],
)
def test_a_publisher_that_cannot_be_reached_is_explained_once(
    make_node, master, api: str, advice: str
) -> None:
    ghost = MasterClient(master.uri, "/camera")
    ghost.register_publisher("/image", "std_msgs/String", api)
    log, lines = listening_log()
    node = make_node("viewer", log=log)
    node.subscribe("/image", String, print)
    wait_until(lambda: lines)
    assert f"cannot receive [/image] from the publisher at {api}" in lines[0]
    assert advice in lines[0]
    subscription = node.endpoints.subscription("/image")
    attempts = subscription.attempts
    wait_until(lambda: subscription.attempts > attempts + 1)
    assert len(lines) == 1
    ghost.close()


# ros_comm#2373, #544, #495: descriptors, threads and buffers of unregistered topics were never freed.


@pytest.mark.skipif(sys.platform != "linux", reason="counts descriptors in /proc")
def test_subscribing_and_unsubscribing_leaves_no_resources(make_node: MakeNode) -> None:
    talker, listener = make_node("talker"), make_node("listener")
    publisher = talker.advertise("chat", String)

    def meet() -> weakref.ref[Inbox]:
        inbox = Inbox()
        subscriber = listener.subscribe("chat", String, inbox)
        wait_until_connected(publisher)
        publisher.publish(String("x"))
        inbox.wait()
        subscriber.unregister()
        wait_until(lambda: publisher.connection_count == 0)
        return weakref.ref(inbox)

    def count() -> tuple[int, int]:
        return len(os.listdir("/proc/self/fd")), threading.active_count()

    meet()
    before = count()
    callbacks = [meet() for _ in range(50)]
    # Each node calls the master once a second over its own connection; both ends are in this process.
    # And each node keeps idle threads, of which it starts more on a busy machine.
    most = (before[0] + 4, before[1] + 2 * KEPT_IDLE)
    wait_until(
        lambda: all(now <= limit for now, limit in zip(count(), most, strict=True)),
        what=lambda: f"{before} became {count()}; threads: {[each.name for each in threading.enumerate()]}",
    )

    def are_gone() -> bool:  # a thread may keep the last one for a moment
        gc.collect()
        return [callback() for callback in callbacks] == [None] * 50

    wait_until(are_gone)
