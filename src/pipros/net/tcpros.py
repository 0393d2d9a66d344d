"""Opening TCPROS connections, from either end: connect or accept, then exchange headers.

What the headers say is decided in `wire/handshake.py`; here they only travel.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pipros.errors import ProtocolError, Unreachable
from pipros.net import sockets
from pipros.net.rpc import reason_of
from pipros.wire.handshake import refuse
from pipros.wire.header import HEADER_LIMIT_BYTES, HeaderReader, encode_header

#: A peer that has not said who it is by then is not going to.
HANDSHAKE_DEADLINE_S = 10.0

#: Connections that may be in their handshake at a time.
HANDSHAKE_LIMIT = 256

#: Without descriptors for new connections, the next attempt is made after so long.
RETRY_ACCEPT_S = 0.1

_CHUNK_BYTES = 16 * 1024


@dataclass(frozen=True, slots=True)
class Connection:
    """A TCPROS connection whose peer has introduced itself.

    Attributes:
        sock: non-blocking; who takes the connection over closes it.
        fields: the peer's connection header.
        rest: bytes that came behind the header already.
    """

    sock: socket.socket
    fields: Mapping[str, str]
    rest: bytes


class TcprosServer:
    """Accepts TCPROS connections and hands each to `on_connection` once its header is in.

    Peers that are silent, talk garbage or announce too much are closed without further words,
    as genuine nodes do. When too many are in their handshake, the one that has been longest gives
    way to the new one, so silent ones lock nobody out. Plain callbacks of the event loop, not
    coroutines: a service call that is not persistent pays for all of this each time.
    """

    def __init__(self, host: str, port: int = 0, *, on_connection: Callable[[Connection], None]) -> None:
        """`on_connection` is called in the event loop and must not block."""
        self._server = sockets.listen(host, port)
        self.port: int = self._server.getsockname()[1]
        self._on_connection = on_connection
        self._greetings: dict[_Greeting, None] = {}  # in the order of arrival
        self._loop: asyncio.AbstractEventLoop

    def start(self) -> None:
        """Begins to accept. Called in the event loop, as `stop` is."""
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._server, self._accept)

    def stop(self) -> None:
        """Closes the port and every connection that is still in its handshake."""
        self._loop.remove_reader(self._server)
        self._server.close()
        for greeting in list(self._greetings):
            greeting.dismiss()

    def _accept(self) -> None:
        try:
            sock, _ = self._server.accept()
        except (BlockingIOError, InterruptedError, ConnectionAbortedError):
            return
        except OSError:  # out of descriptors: others go on, and it may pass
            self._loop.remove_reader(self._server)
            self._loop.call_later(RETRY_ACCEPT_S, self._accept_again)
            return
        greeting = _Greeting(sock, self._on_connection)
        if not greeting.read():  # most peers have said it by now
            greeting.wait(self._loop, self._forget)
            self._greetings[greeting] = None
            if len(self._greetings) > HANDSHAKE_LIMIT:
                next(iter(self._greetings)).dismiss()

    def _accept_again(self) -> None:
        if self._server.fileno() >= 0:
            self._loop.add_reader(self._server, self._accept)

    def _forget(self, greeting: _Greeting) -> None:
        self._greetings.pop(greeting, None)


class _Greeting:
    """A connection whose peer has not said yet who it is."""

    def __init__(self, sock: socket.socket, on_connection: Callable[[Connection], None]) -> None:
        sock.setblocking(False)
        self._sock = sock
        self._on_connection = on_connection
        self._reader = HeaderReader(HEADER_LIMIT_BYTES)
        self._leave: Callable[[], None] = _nothing

    def wait(self, loop: asyncio.AbstractEventLoop, on_end: Callable[[_Greeting], None]) -> None:
        """Has the loop read on, up to a deadline, and `on_end` called when there is nothing left to read."""
        deadline = loop.call_later(HANDSHAKE_DEADLINE_S, self.dismiss)
        number = self._sock.fileno()  # to register a socket itself would cost its repr

        def leave() -> None:
            deadline.cancel()
            loop.remove_reader(number)
            on_end(self)

        self._leave = leave
        loop.add_reader(number, self.read)

    def dismiss(self) -> None:
        """Closes the connection without a word."""
        self._leave()
        self._sock.close()

    def read(self) -> bool:
        """Reads what is there; False when the peer has to say more."""
        try:
            data = self._sock.recv(_CHUNK_BYTES)
            fields = self._reader.feed(data) if data else None
            if fields is not None:
                sockets.prepare(self._sock)
        except (BlockingIOError, InterruptedError):
            return False
        except (OSError, ProtocolError):
            data, fields = b"", None
        if fields is not None:
            self._leave()
            self._on_connection(Connection(self._sock, fields, self._reader.rest))
        elif data:
            return False
        else:
            self.dismiss()
        return True


def _nothing() -> None:
    pass


async def connect(host: str, port: int, fields: Mapping[str, str], *, no_delay: bool = True) -> Connection:
    """Connects to a TCPROS server, says `fields`, and returns with the peer's answer.

    Raises:
        Unreachable: nobody there, or silence for HANDSHAKE_DEADLINE_S.
        ProtocolError: the peer closed without an answer, or its answer is malformed.
    """
    loop = asyncio.get_running_loop()

    async def shake_hands() -> Connection:
        sock = await _connect_first(loop, host, port)
        try:
            sockets.prepare(sock, no_delay=no_delay)
            await loop.sock_sendall(sock, encode_header(fields))
            answer, rest = await _read_header(sock)
        except BaseException:
            sock.close()
            raise
        return Connection(sock, answer, rest)

    try:
        return await asyncio.wait_for(shake_hands(), HANDSHAKE_DEADLINE_S)
    except asyncio.TimeoutError:
        raise Unreachable(f"{host}:{port}", f"no answer within {HANDSHAKE_DEADLINE_S:g} s") from None
    except OSError as error:
        raise Unreachable(f"{host}:{port}", reason_of(error)) from error


def refuse_connection(sock: socket.socket, reason: str) -> None:
    """Tells a peer why it is refused, if its socket takes so few bytes at once, and closes."""
    with contextlib.suppress(OSError):
        sock.send(encode_header(refuse(reason)))
    sock.close()


async def _connect_first(loop: asyncio.AbstractEventLoop, host: str, port: int) -> socket.socket:
    """A connection to the first address of the host that takes one."""
    failure: OSError = OSError("the name has no address")
    for family, kind, protocol, _, address in await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM):
        sock = socket.socket(family, kind, protocol)
        sock.setblocking(False)
        try:
            await loop.sock_connect(sock, address)
        except OSError as error:
            sock.close()
            failure = error
        except BaseException:
            sock.close()
            raise
        else:
            return sock
    raise failure


async def _read_header(sock: socket.socket) -> tuple[Mapping[str, str], bytes]:
    loop = asyncio.get_running_loop()
    reader = HeaderReader(HEADER_LIMIT_BYTES)
    while True:
        data = await loop.sock_recv(sock, _CHUNK_BYTES)
        if not data:
            raise ProtocolError("the peer closed the connection before it said who it is")
        fields = reader.feed(data)
        if fields is not None:
            return fields, reader.rest
