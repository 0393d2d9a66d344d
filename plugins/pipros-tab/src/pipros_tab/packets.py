"""The packets between a worker and the hub, which connects the workers of a tab.

A packet is a head of three 32-bit numbers (size of the content, kind, end of a connection) and its content.
A worker numbers the connections that it opens and the ports that it requests; the hub (`page/hub.mjs`)
numbers the ends that workers accept. The hub passes CREDIT, DATA, FINISH and RESET to the other end of a
connection.

Other packets start programs, and share files: the content of FILE is a line of JSON, then a piece of the file
(`files.py`).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from enum import IntEnum
from typing import Final, NamedTuple

HEAD: Final = struct.Struct("<III")
NUMBER: Final = struct.Struct("<I")


class PacketKind(IntEnum):
    """What a packet says. Content: a port, a number of bytes, data, or JSON."""

    LISTEN = 1  # to the hub: open a port, or any port if it is 0
    LISTENING = 2  # to the worker: the port that was opened, or 0
    CLOSE_PORT = 3  # to the hub: the number is the port
    CONNECT = 4  # to the hub: connect to a port
    CONNECTED = 5  # to the worker
    REFUSED = 6  # to the worker: no worker listens at the port
    ACCEPT = 7  # to the worker that listens: the port that was connected to
    DATA = 8
    CREDIT = 9  # the receiver has read so many bytes
    FINISH = 10  # no more data follows
    RESET = 11  # the connection has ended
    START = 12  # to the hub: start a program (JSON); the number is that of the request
    STARTED = 13  # to the worker: the number of the process
    ENDED = 14  # to the worker: a process that it started has ended; its exit code
    SIGNAL = 15  # to the hub: a process, and the number of a signal
    FILE = 16  # a piece of a file that has changed, or its removal
    TYPED = 17  # to the worker: what a user does in its terminal, or the keys for its program (JSON)


class Packet(NamedTuple):
    kind: PacketKind
    end: int
    content: bytes = b""


def split(received: bytes) -> Iterator[Packet]:
    """Yield the packets in bytes that contain only whole packets."""
    at = 0
    while at < len(received):
        size, kind, end = HEAD.unpack_from(received, at)
        at += HEAD.size
        yield Packet(PacketKind(kind), end, received[at : at + size])
        at += size
