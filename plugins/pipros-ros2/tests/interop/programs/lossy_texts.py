"""Publishes texts of 1 MB for ROS 2 faster than they arrive, while large datagrams are lost; then short ones.

The only argument is the share of the datagrams above 20 kB that are lost.
"""

from __future__ import annotations

import itertools
import random
import struct
import sys
import time

from pipros_ros2.interface import TopicQos
from pipros_ros2.rtps import sockets
from pipros_ros2.rtps.domain import Discovery
from pipros_ros2.rtps.engine import RtpsEngine

send, loss = sockets._send, float(sys.argv[1])
chance = random.Random(1)  # noqa: S311


def send_or_lose(through: sockets.socket.socket, parts: tuple[bytes, ...], address: sockets.Address) -> None:
    if sum(map(len, parts)) < 20_000 or chance.random() >= loss:
        send(through, parts, address)


def text(number: int, size: int) -> bytes:
    """Return a std_msgs/String as little-endian CDR."""
    body = f"{number:6}".encode() + bytes([120]) * size + b"\0"
    return struct.pack("<HHI", 0x0100, 0, len(body)) + body


sockets._send = send_or_lose  # type: ignore[assignment]  # the network of the test has no other way to lose datagrams
engine = RtpsEngine(Discovery(0), "/talker")
publisher = engine.advertise("/texts", "std_msgs/msg/String", "", TopicQos(depth=4))
while publisher.subscriber_count == 0:
    time.sleep(0.02)
for number in range(200):
    publisher.publish(text(number, 1_000_000))
    time.sleep(0.002)
print("sent", flush=True)
for number in itertools.count(200):
    publisher.publish(text(number, 0))
    time.sleep(0.05)
