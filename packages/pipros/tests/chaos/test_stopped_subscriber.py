"""A subscriber that stops reading, among healthy ones."""

from __future__ import annotations

import socket
import struct
import time
from typing import Any

import pytest

from pipros.basics.limits import Limits
from pipros.msg import load_message_class
from pipros.net.timings import LinkTimings
from pipros.node.timings import NodeTimings
from pipros.wire.header import HeaderReader, encode_header
from tests.support.nodes import Inbox, MakeNode, wait_until_connected
from tests.support.waiting import wait_until

UInt8MultiArray: Any = load_message_class("std_msgs/UInt8MultiArray")

HEALTHY = 5
COUNT = 300
SIZE = 60_000


def numbered(number: int) -> Any:
    return UInt8MultiArray(data=struct.pack("<I", number) * (SIZE // 4))


def number_of(message: Any) -> int:
    number: int = struct.unpack_from("<I", message.data)[0]
    return number


@pytest.mark.parametrize("queue_size", [None, 1, 10])
def test_five_subscribers_miss_nothing_while_a_sixth_is_stopped_and_later_catches_up(
    make_node: MakeNode, queue_size: int | None
) -> None:
    # A subscriber that does not read is still alive, and must not be dropped like one that vanished.
    # On a busy machine, even the system of a live peer may acknowledge probes late.
    links = LinkTimings(check_peer_interval_s=0.01, unanswered_s=1.0)
    talker, listeners = (
        make_node("talker", limits=Limits(stall_s=0.05), timings=NodeTimings(links=links)),
        [make_node(f"listener{number}") for number in range(HEALTHY)],
    )
    publisher = talker.advertise("chat", UInt8MultiArray, queue_size=queue_size)
    inboxes = [Inbox() for _ in listeners]
    for listener, inbox in zip(listeners, inboxes, strict=True):
        listener.subscribe("chat", UInt8MultiArray, inbox)
    with socket.create_connection(("127.0.0.1", talker.endpoints.port), 30) as stopped:
        stopped.sendall(encode_header({"topic": "/chat", "md5sum": "*", "callerid": "/stopped"}))
        wait_until_connected(publisher, HEALTHY + 1)
        longer_than_limit = time.monotonic() + 2 * links.unanswered_s

        for number in range(COUNT):
            publisher.publish(numbered(number))
            for inbox in inboxes:  # at its own speed
                inbox.wait(number + 1)
        for inbox in inboxes:
            assert [number_of(message) for message in inbox.messages] == list(range(COUNT))
        wait_until(lambda: time.monotonic() > longer_than_limit)
        links = talker.statistics()["publications"]["/chat"]
        assert links["/stopped"].dropped > COUNT // 2
        assert [links[f"/listener{number}"].dropped for number in range(HEALTHY)] == [0] * HEALTHY

        numbers = Reader(stopped)
        wait_until(lambda: numbers.next() == COUNT - 1)
        assert numbers.seen == sorted(numbers.seen)
        publisher.publish(numbered(COUNT))
        assert numbers.next() == COUNT


class Reader:
    """Reads messages from a socket after its connection header."""

    def __init__(self, sock: socket.socket) -> None:
        self.sock = sock
        self.seen: list[int] = []
        reader = HeaderReader()
        while reader.feed(sock.recv(16)) is None:
            pass
        self.rest = reader.rest

    def next(self) -> int:
        (length,) = struct.unpack("<I", self.take(4))
        self.seen.append(number_of(UInt8MultiArray().deserialize(self.take(length))))
        return self.seen[-1]

    def take(self, count: int) -> bytes:
        while len(self.rest) < count:
            data = self.sock.recv(1 << 20)
            assert data
            self.rest += data
        taken, self.rest = self.rest[:count], self.rest[count:]
        return taken
