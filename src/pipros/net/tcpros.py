"""Opening TCPROS connections, from either end: connect or accept, then exchange headers.

What the headers say is decided in `wire/handshake.py`; here they only travel.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass

from pipros.errors import ProtocolError, Unreachable
from pipros.net import sockets
from pipros.net.rpc import reason_of
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
    way to the new one, so silent ones lock nobody out.
    """

    def __init__(
        self, host: str, port: int = 0, *, on_connection: Callable[[Connection], Awaitable[None]]
    ) -> None:
        self._server = sockets.listen(host, port)
        self.port: int = self._server.getsockname()[1]
        self._on_connection = on_connection
        self._accepting: asyncio.Task[None] | None = None
        self._greeting: dict[asyncio.Task[None], socket.socket] = {}  # in the order of arrival

    async def start(self) -> None:
        self._accepting = asyncio.ensure_future(self._accept())

    async def stop(self) -> None:
        """Closes the port and every connection that is still in its handshake."""
        self._server.close()
        tasks = [*self._greeting, *([self._accepting] if self._accepting is not None else [])]
        while self._greeting:
            self._dismiss_oldest()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _accept(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                sock, _ = await loop.sock_accept(self._server)
            except OSError:  # out of descriptors: others go on, and it may pass
                await asyncio.sleep(RETRY_ACCEPT_S)
                continue
            task = asyncio.ensure_future(self._greet(sock))
            self._greeting[task] = sock
            task.add_done_callback(lambda task: self._greeting.pop(task, None))
            if len(self._greeting) > HANDSHAKE_LIMIT:
                self._dismiss_oldest()

    def _dismiss_oldest(self) -> None:
        task, sock = next(iter(self._greeting.items()))
        del self._greeting[task]
        task.cancel()
        task.add_done_callback(lambda _: sock.close())  # a task that never ran does not close it

    async def _greet(self, sock: socket.socket) -> None:
        try:
            sock.setblocking(False)
            sockets.prepare(sock)
            fields, rest = await asyncio.wait_for(_read_header(sock), HANDSHAKE_DEADLINE_S)
        except (OSError, ProtocolError, asyncio.TimeoutError):
            sock.close()
            return
        current = asyncio.current_task()
        if current is not None:
            self._greeting.pop(current, None)  # from here on it is somebody else's
        try:
            await self._on_connection(Connection(sock, fields, rest))
        except OSError:  # it left while it was being answered
            sock.close()
        except BaseException:
            sock.close()
            raise


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


async def send_header(sock: socket.socket, fields: Mapping[str, str]) -> None:
    await asyncio.get_running_loop().sock_sendall(sock, encode_header(fields))


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
