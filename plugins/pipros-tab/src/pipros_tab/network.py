"""The network of a tab, seen from one worker: streams of bytes to ports of all workers.

Theory of operation. The hub passes packets between workers (`packets.py`). Each end of a connection may send
`WINDOW_BYTES` that the other end has not read, so no queue between the workers grows beyond that, and a
worker that never reads delays no other. Received packets are handled whenever the worker waits or sends.
"""

from __future__ import annotations

import errno
import itertools
import json
import math
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from pipros_tab.packets import NUMBER, Packet, PacketKind, split

WINDOW_BYTES: Final = 256 * 1024
"""Maximum number of bytes that one end of a connection has sent and the other has not read."""

LONGEST_WAIT_S: Final = 0.2
"""Longest wait for packets without a look at interrupts."""

_PACKET_BYTES: Final = 64 * 1024
_BACKLOG: Final = 128
_MOST_KEYS: Final = 100
_HUB_S: Final = 5.0
"""How long the hub may take to open a port."""


class Port(Protocol):
    """The worker's rings to and from the hub, implemented in JavaScript (`page/ring.mjs`)."""

    def send(self, kind: int, end: int, content: bytes, /) -> None:
        """Send a packet. Waits while the ring to the hub is full."""

    def receive(self, timeout_s: float, /) -> bytes:
        """Return all received packets. If there are none, wait; return `b""` after the timeout."""

    def is_interrupted(self, /) -> bool:
        """Return whether the hub has asked for an interrupt since the last call."""


class TabStream:
    """One end of a connection.

    Attributes:
        error: the error number of a connection that was refused, or 0.
        is_connected: whether the hub has connected it to the other end.
        is_finished: whether the other end has stopped sending.
    """

    def __init__(self, network: Network, number: int) -> None:
        self.error = 0
        self.is_connected = False
        self.is_finished = False
        self._network = network
        self._number = number
        self._received: deque[memoryview] = deque()
        self._unreported = 0  # bytes that were read since the last CREDIT
        self._credit = WINDOW_BYTES
        self._may_send = True

    @property
    def is_readable(self) -> bool:
        return bool(self._received) or self.is_finished or bool(self.error)

    @property
    def is_writable(self) -> bool:
        return bool(self.error) or not self._may_send or (self.is_connected and self._credit > 0)

    def write(self, data: memoryview) -> int:
        """Send as much as the other end has room for; return the number of bytes.

        Raises:
            BlockingIOError: there is no room.
            BrokenPipeError: the connection has ended.
        """
        if self.error or not self._may_send:
            raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
        count = min(len(data), self._credit)
        if len(data) and not (self.is_connected and count):
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        self._credit -= count
        for start in range(0, count, _PACKET_BYTES):
            piece = data[start : min(count, start + _PACKET_BYTES)]
            self._network.send(PacketKind.DATA, self._number, bytes(piece))
        return count

    def read_into(self, buffer: memoryview) -> int:
        """Read received bytes; return their number, or 0 at the end of the stream.

        Raises:
            BlockingIOError: there are none.
            ConnectionRefusedError: the connection was refused.
        """
        count = 0
        while self._received and count < len(buffer):
            piece = self._received[0][: len(buffer) - count]
            buffer[count : count + len(piece)] = piece
            count += len(piece)
            if len(piece) < len(self._received[0]):
                self._received[0] = self._received[0][len(piece) :]
            else:
                self._received.popleft()
        if count:
            self._report(count)
        elif self.error:
            raise OSError(self.error, os.strerror(self.error))
        elif not self.is_finished and len(buffer):
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        return count

    def _report(self, count: int) -> None:
        self._unreported += count
        if self._unreported >= WINDOW_BYTES // 4 and not self.is_finished:
            self._network.send(PacketKind.CREDIT, self._number, NUMBER.pack(self._unreported))
            self._unreported = 0

    def finish(self) -> None:
        """Tell the other end that no more data follows."""
        if self._may_send:
            self._may_send = False
            self._network.send(PacketKind.FINISH, self._number)

    def stop_receiving(self) -> None:
        """Discard what has arrived and what arrives later."""
        self._received.clear()
        self.is_finished = True

    def close(self) -> None:
        """End the connection. The other end can still read what was sent. May be called repeatedly."""
        if self._network.forget(self._number):
            self._network.send(PacketKind.RESET, self._number)
        self.stop_receiving()
        self._may_send = False

    def take(self, packet: Packet) -> None:
        """Handle a packet from the other end."""
        match packet.kind:
            case PacketKind.CONNECTED:
                self.is_connected = True
            case PacketKind.REFUSED:
                self.error = errno.ECONNREFUSED
                self._network.forget(self._number)
            case PacketKind.DATA if not self.is_finished:
                self._received.append(memoryview(packet.content))
            case PacketKind.CREDIT:
                self._credit += NUMBER.unpack(packet.content)[0]
            case PacketKind.FINISH:
                self.is_finished = True
            case PacketKind.RESET:
                self.is_finished, self._may_send = True, False
                self._network.forget(self._number)


class Network:
    """The connections, ports and child processes of one worker.

    Attributes:
        port: the rings.
        codes: the exit codes of the child processes that have ended.
        typed: what the user did in the worker's terminal.
        keys: the keys that were pressed in the terminal and are not read yet; at most `_MOST_KEYS`.
        take_file: called with each piece of a file that another worker has changed.
    """

    def __init__(self, port: Port) -> None:
        """Use the rings of the worker."""
        self.port = port
        self._numbers = itertools.count(1)
        self._streams: dict[int, TabStream] = {}
        self._listeners: dict[int, deque[TabStream]] = {}
        self._opened: dict[int, int] = {}  # ports that the hub has opened, by the number of the request
        self._started: dict[int, int] = {}  # processes, by the number of the request
        self.codes: dict[int, int] = {}
        self.typed: deque[Mapping[str, Any]] = deque()
        self.keys = bytearray()
        self._wants_keys = False
        self.take_file: Callable[[bytes], None] = lambda _: None

    def send(self, kind: PacketKind, end: int, content: bytes = b"") -> None:
        self.port.send(kind, end, content)

    def forget(self, number: int) -> bool:
        """Forget one end of a connection; return False if that was done before."""
        return self._streams.pop(number, None) is not None

    def connect(self, port: int) -> TabStream:
        """Begin to connect to a port."""
        number = next(self._numbers)
        stream = self._streams[number] = TabStream(self, number)
        self.send(PacketKind.CONNECT, number, NUMBER.pack(port))
        return stream

    def listen(self, port: int) -> tuple[int, deque[TabStream]]:
        """Open a port, or any free port if it is 0. Return it, and the queue of its new connections.

        Raises:
            OSError: another worker has the port, or the hub does not answer.
        """
        request = next(self._numbers)
        self.send(PacketKind.LISTEN, request, NUMBER.pack(port))
        if not self.wait(lambda: request in self._opened, _HUB_S):
            raise TimeoutError(errno.ETIMEDOUT, "the hub of the tab does not answer")
        opened = self._opened.pop(request)
        if not opened:
            raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))
        arrived: deque[TabStream] = deque()
        self._listeners[opened] = arrived
        return opened, arrived

    def ask_for_keys(self) -> None:
        """Let the terminal send each key, from now on until the program ends; see `terminal.py`."""
        if not self._wants_keys:
            self._wants_keys = True
            print("\033]133;K;\007", end="", flush=True)

    def close_port(self, port: int) -> None:
        """Close a port and the connections that were not accepted."""
        for stream in self._listeners.pop(port, ()):
            stream.close()
        self.send(PacketKind.CLOSE_PORT, port)

    def start(self, program: Mapping[str, Any]) -> int:
        """Start a program in a new worker (see `program.run_with`), and return the number of the process.

        Raises:
            TimeoutError: the hub does not answer.
        """
        request = next(self._numbers)
        self.send(PacketKind.START, request, json.dumps(program).encode())
        if not self.wait(lambda: request in self._started, _HUB_S):
            raise TimeoutError(errno.ETIMEDOUT, "the hub of the tab does not answer")
        return self._started.pop(request)

    def wait(self, is_over: Callable[[], bool], timeout_s: float | None) -> bool:
        """Receive until `is_over` returns True; return False if the timeout expires first."""
        end_s = math.inf if timeout_s is None else time.monotonic() + timeout_s
        while not is_over():
            left_s = end_s - time.monotonic()
            if left_s <= 0:
                return False
            self.receive(min(left_s, LONGEST_WAIT_S))
        return True

    def receive(self, timeout_s: float) -> bool:
        """Handle the packets that have arrived; if there are none, wait. Return False after the timeout.

        If the hub interrupts the worker, the handler of SIGINT is called.
        """
        received = self.port.receive(timeout_s)
        for packet in split(received):
            self._take(packet)
        if self.port.is_interrupted():
            handler = signal.getsignal(signal.SIGINT)
            if callable(handler):
                handler(signal.SIGINT, None)
        return bool(received)

    def _take(self, packet: Packet) -> None:
        if packet.kind is PacketKind.LISTENING:
            self._opened[packet.end] = NUMBER.unpack(packet.content)[0]
        elif packet.kind is PacketKind.STARTED:
            self._started[packet.end] = NUMBER.unpack(packet.content)[0]
        elif packet.kind is PacketKind.ENDED:
            self.codes[packet.end] = NUMBER.unpack(packet.content)[0]
        elif packet.kind is PacketKind.FILE:
            self.take_file(packet.content)
        elif packet.kind is PacketKind.TYPED:
            typed = json.loads(packet.content)
            if "keys" in typed:
                self.keys[_MOST_KEYS:] = b""
                self.keys += typed["keys"].encode()
            else:
                self.typed.append(typed)
        elif packet.kind is PacketKind.ACCEPT:
            arrived = self._listeners.get(NUMBER.unpack(packet.content)[0])
            stream = self._streams[packet.end] = TabStream(self, packet.end)
            stream.is_connected = True
            if arrived is None or len(arrived) >= _BACKLOG:
                stream.close()
            else:
                arrived.append(stream)
        elif packet.end in self._streams:
            self._streams[packet.end].take(packet)
