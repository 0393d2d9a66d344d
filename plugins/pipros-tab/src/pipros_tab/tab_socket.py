"""A replacement for Python's `socket.socket`, whose streams connect the workers of a tab."""

from __future__ import annotations

import errno
import io
import itertools
import os
import socket
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, Final

from pipros_tab.network import Network, TabStream

NO_LINES: Final = "the programs of a browser tab read keys, but no lines: use arguments, parameters or topics"
HERE: Final = "127.0.0.1"
"""The address of the tab. All names of this machine resolve to it."""
Data = bytes | bytearray | memoryview
FIRST_DESCRIPTOR: Final = 1_000_000
OPTIONS: Final = {"SO_REUSEADDR": 2, "SO_ERROR": 4, "SO_KEEPALIVE": 9, "TCP_NODELAY": 1}
"""Options of sockets that Pyodide's `socket` may lack, and that `TabSocket` ignores, except SO_ERROR."""


class _StreamFile(io.RawIOBase):
    """The received bytes of a socket as a file."""

    def __init__(self, sock: TabSocket) -> None:
        self._sock = sock

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        return self._sock.recv_into(buffer)


class TabSocket:
    """A TCP socket. Only the methods of `socket.socket` that nodes, asyncio and XML-RPC use exist."""

    network: ClassVar[Network]
    by_descriptor: ClassVar[dict[int, TabSocket]] = {}
    wait: ClassVar[Callable[[Callable[[], bool], float | None], bool]]
    _descriptors: ClassVar = itertools.count(FIRST_DESCRIPTOR)

    def __init__(
        self,
        family: int = -1,
        type: int = -1,  # noqa: A002
        proto: int = -1,
        fileno: int | None = None,
    ) -> None:
        """Create a socket that is not connected, or take over the one with the descriptor `fileno`.

        Raises:
            OSError: another family or type was requested; a tab has only TCP streams.
        """
        if fileno in TabSocket.by_descriptor:
            detached = TabSocket.by_descriptor[fileno]
            self.__dict__.update(detached.__dict__)
            TabSocket.by_descriptor[fileno] = self
            return
        if fileno is not None or family not in (-1, socket.AF_INET) or type not in (-1, socket.SOCK_STREAM):
            raise OSError(errno.EAFNOSUPPORT, "a browser tab has only TCP streams between its nodes")
        self.family, self.type, self.proto = socket.AF_INET, socket.SOCK_STREAM, max(proto, 0)
        self._number = next(TabSocket._descriptors)
        TabSocket.by_descriptor[self._number] = self
        self._stream: TabStream | None = None
        self._arrived: deque[TabStream] | None = None  # set if the socket listens
        self._name, self._peer = (HERE, 0), (HERE, 0)
        self._timeout: float | None = None

    # -- connecting ---------------------------------------------------------------

    def bind(self, address: tuple[Any, ...]) -> None:
        """Open the port.

        Raises:
            OSError: the port is in use.
        """
        port, self._arrived = self.network.listen(address[1])
        self._name = HERE, port

    def listen(self, backlog: int = 128) -> None:
        """Do nothing: `bind` has opened the port."""

    def accept(self) -> tuple[TabSocket, tuple[str, int]]:
        """Return a new connection and the address of its other end."""
        arrived = self._arrived
        if arrived is None:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        self._block(lambda: bool(arrived))
        accepted = TabSocket()
        accepted._stream = arrived.popleft()
        accepted._name = self._name
        return accepted, accepted._peer

    def connect(self, address: tuple[Any, ...]) -> None:
        """Connect to a port of the tab.

        Raises:
            ConnectionRefusedError: no node listens there.
            BlockingIOError: the socket is non-blocking, and the hub has not answered yet.
        """
        self._peer = HERE, address[1]
        stream = self._stream = self.network.connect(address[1])
        self._block(lambda: stream.is_writable, errno.EINPROGRESS)
        if stream.error:
            raise OSError(stream.error, os.strerror(stream.error))

    def shutdown(self, how: int) -> None:
        """Stop sending, receiving, or both."""
        stream = self._connected()
        if how != socket.SHUT_RD:
            stream.finish()
        if how != socket.SHUT_WR:
            stream.stop_receiving()

    def close(self) -> None:
        """Close the connection or the port. May be called repeatedly."""
        if TabSocket.by_descriptor.pop(self._number, None) is None:
            return
        if self._arrived is not None:
            self.network.close_port(self._name[1])
        if self._stream is not None:
            self._stream.close()

    def detach(self) -> int:
        """Return the descriptor, for a new socket that takes over the connection or the port."""
        return self._number

    def __enter__(self) -> TabSocket:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- data ---------------------------------------------------------------------

    def send(self, data: Data, _flags: int = 0) -> int:
        """Send some of the bytes; return their number."""
        stream, view = self._connected(), memoryview(data).cast("B")
        if self._timeout != 0:
            self._block(lambda: stream.is_writable)
        return stream.write(view)

    def sendall(self, data: Data, _flags: int = 0) -> None:
        """Send all bytes, and wait for room if necessary."""
        view = memoryview(data).cast("B")
        while view:
            view = view[self.send(view) :]

    def sendmsg(self, buffers: Iterable[Data], *_: object) -> int:
        """Send some of the bytes of several buffers; return their number."""
        return self.send(b"".join(buffers))

    def recv_into(self, buffer: Data, count: int = 0, flags: int = 0) -> int:
        """Receive bytes; return their number, or 0 at the end of the stream."""
        stream, view = self._connected(), memoryview(buffer).cast("B")
        view = view[:count] if count else view
        if self._timeout != 0 and not flags & getattr(socket, "MSG_DONTWAIT", 0):
            self._block(lambda: stream.is_readable)
        return stream.read_into(view)

    def recv(self, count: int, flags: int = 0) -> bytes:
        """Receive at most `count` bytes; return `b""` at the end of the stream."""
        buffer = bytearray(count)
        return bytes(memoryview(buffer)[: self.recv_into(buffer, 0, flags)])

    def makefile(self, _mode: str = "rb", *_: object) -> io.BufferedReader:
        """Return a file with the received bytes, as HTTP clients use it."""
        return io.BufferedReader(_StreamFile(self))

    # -- state --------------------------------------------------------------------

    @property
    def is_readable(self) -> bool:
        """Whether `accept` or `recv` would not wait."""
        return bool(self._arrived) or (self._stream is not None and self._stream.is_readable)

    @property
    def is_writable(self) -> bool:
        """Whether `send` would not wait."""
        return self._stream is not None and self._stream.is_writable

    def fileno(self) -> int:
        return self._number if self._number in TabSocket.by_descriptor else -1

    def getsockname(self) -> tuple[str, int]:
        return self._name

    def getpeername(self) -> tuple[str, int]:
        self._connected()
        return self._peer

    def setblocking(self, flag: bool) -> None:
        self._timeout = None if flag else 0.0

    def settimeout(self, timeout: float | None) -> None:
        self._timeout = timeout

    def gettimeout(self) -> float | None:
        return self._timeout

    def getblocking(self) -> bool:
        return self._timeout != 0

    def set_inheritable(self, inheritable: bool) -> None:
        """Do nothing: a tab has no child processes."""

    def setsockopt(self, *_: object) -> None:
        """Do nothing: streams between workers have no options."""

    def getsockopt(self, _level: int, option: int, *size: int) -> int:
        """Return the error of a failed connection for SO_ERROR, and 0 for other options.

        Raises:
            OSError: `size` is given; there are no options with a structure, such as TCP_INFO.
        """
        if size:
            raise OSError(errno.ENOPROTOOPT, os.strerror(errno.ENOPROTOOPT))
        return self._stream.error if option == socket.SO_ERROR and self._stream is not None else 0

    def _connected(self) -> TabStream:
        if self._stream is None or self.fileno() < 0:
            number = errno.EBADF if self.fileno() < 0 else errno.ENOTCONN
            raise OSError(number, os.strerror(number))
        return self._stream

    def _block(self, is_over: Callable[[], bool], would_block: int = errno.EAGAIN) -> None:
        """Wait as the timeout of the socket says."""
        if is_over():
            return
        if self._timeout == 0:
            raise BlockingIOError(would_block, os.strerror(would_block))
        if not TabSocket.wait(is_over, self._timeout):
            raise TimeoutError("timed out")
