"""ros_comm#373, #557, #432, #1362: with five subscribers, or a queue_size, 100 Hz fell to 5 or 10.

The causes were a sleeping queue, a message that was serialised for each subscriber, and Nagle's algorithm,
which delays small messages.
"""

from __future__ import annotations

import socket
import struct
from typing import Any

import pytest

from pipros.msg import load_message_class
from pipros.node import Node
from pipros.wire.header import HeaderReader, encode_header
from tests.support.nodes import Inbox, MakeNode, wait_until_connected

UInt8MultiArray: Any = load_message_class("std_msgs/UInt8MultiArray")

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
def test_five_subscribers_get_every_message_and_it_is_serialised_once(
    make_node: MakeNode, queue_size: int | None
) -> None:
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
def test_a_message_is_sent_when_publish_returns(
    make_node: MakeNode, queue_size: int | None, size: int
) -> None:
    talker = make_node("talker")
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=queue_size)
    raw = RawSubscriber(talker)
    wait_until_connected(publisher)
    for number in range(20):
        body = struct.pack("<III", 0, 0, size) + bytes([number]) * size
        publisher.publish(UInt8MultiArray(data=bytes([number]) * size))
        assert raw.take_now(len(body) + 4) == struct.pack("<I", len(body)) + body
    raw.close()
