"""Opening TCPROS connections, from either end: connect or accept, then exchange headers.

What the headers say is decided in `wire/handshake.py`; here they only travel.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import socket
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pipros.errors import ProtocolError, Unreachable
from pipros.limits import Limits, process_limits
from pipros.net import sockets
from pipros.net.address import plain_address
from pipros.net.connections import Connections, Refusals
from pipros.net.rpc_client import reason_of
from pipros.wire.handshake import refuse
from pipros.wire.header import HeaderReader, encode_header

#: Without descriptors for new connections, the next attempt is made after so long.
RETRY_ACCEPT_S = 0.1

#: How much of the process's descriptors a node's TCPROS connections may take.
DESCRIPTORS_SHARE = 0.75

_SWEEP_EVERY_S = 1.0

#: Connections that wait to be accepted. A client that finds no place among them tries again after a second.
_BACKLOG = 1024

_CHUNK_BYTES = 16 * 1024

_log = logging.getLogger("pipros.tcpros")


@dataclass(frozen=True, slots=True)
class TcprosConnection:
    """A TCPROS connection whose peer has introduced itself.

    Attributes:
        sock: non-blocking; its new owner closes it.
        fields: the peer's connection header.
        rest: bytes that came behind the header already.
        peer: the IP address of the other side.
    """

    sock: socket.socket
    fields: Mapping[str, str]
    rest: bytes
    peer: str = ""


class TcprosServer:
    """Accepts TCPROS connections and hands each to `on_connection` once its header is in.

    Peers that are silent, talk garbage or announce too much are closed without further words,
    as genuine nodes do. When too many are in their handshake, the one that has been longest gives
    way to the new one, so silent ones do not lock others out. Plain callbacks of the event loop, not
    coroutines: a service call that is not persistent pays for all of this each time.

    Attributes:
        refusals: what peers were refused.
        connections: where `on_connection` enters those that it keeps. They are swept each second.
    """

    def __init__(
        self,
        host: str,
        port: int = 0,
        *,
        on_connection: Callable[[TcprosConnection], None],
        limits: Limits | None = None,
        log: logging.Logger = _log,
    ) -> None:
        """Opens the port; nothing is accepted until `start`.

        Args:
            host: the address to listen on.
            port: the port; 0 takes a free one.
            on_connection: called in the event loop; must not block.
            limits: what peers may cost; by default those of the process.
            log: where refusals are reported.

        Raises:
            OSError: the port is taken, or the address is not of this machine.
        """
        self._server = sockets.listen(host, port, _BACKLOG)
        self.port: int = self._server.getsockname()[1]
        self._on_connection = on_connection
        self._limits = limits = limits or process_limits()
        in_all = limits.tcpros_connections or sockets.connections_that_fit(DESCRIPTORS_SHARE)
        self._greetings_limit = min(limits.handshakes, max(1, in_all // 4))
        room = max(1, in_all - self._greetings_limit)
        self.refusals = Refusals(log)
        self.connections = Connections(
            limit=room,
            limit_per_peer=limits.tcpros_connections_per_peer or max(1, room // 2),
            spares_loopback=not limits.tcpros_connections_per_peer,
            refusals=self.refusals,
        )
        self._greetings: dict[_Greeting, None] = {}  # in the order of arrival
        self._sweeper: asyncio.TimerHandle | None = None
        self._loop: asyncio.AbstractEventLoop

    def start(self) -> None:
        """Begins to accept. Called in the event loop, as `stop` is."""
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._server, self._accept)
        self._sweep()

    @property
    def descriptors(self) -> list[int]:
        """The descriptor of the port, while it is open."""
        return [number] if (number := self._server.fileno()) >= 0 else []

    def stop(self) -> None:
        """Closes the port and every connection that is still in its handshake."""
        self._loop.remove_reader(self._server)
        self._server.close()
        if self._sweeper:
            self._sweeper.cancel()
        for greeting in list(self._greetings):
            greeting.dismiss()

    def _accept(self) -> None:
        try:
            sock, address = self._server.accept()
        except (BlockingIOError, InterruptedError, ConnectionAbortedError):
            return
        except OSError:  # out of descriptors: others go on, and it may pass
            self._loop.remove_reader(self._server)
            self._loop.call_later(RETRY_ACCEPT_S, self._accept_again)
            return
        greeting = _Greeting(sock, plain_address(str(address[0])), self._limits, self._on_connection)
        if not greeting.read():  # most headers have arrived by now
            greeting.wait(self._loop, self._forget)
            self._greetings[greeting] = None
            if len(self._greetings) > self._greetings_limit:
                longest = next(iter(self._greetings))
                self.refusals.count(longest.peer, "too many connections that do not say who they are")
                longest.dismiss()

    def _accept_again(self) -> None:
        if self._server.fileno() >= 0:
            self._loop.add_reader(self._server, self._accept)

    def _sweep(self) -> None:
        self.connections.sweep(self._loop.time(), idle_s=math.inf)
        self._sweeper = self._loop.call_later(_SWEEP_EVERY_S, self._sweep)

    def _forget(self, greeting: _Greeting) -> None:
        self._greetings.pop(greeting, None)


class _Greeting:
    """A connection whose peer has not sent its header yet."""

    def __init__(
        self,
        sock: socket.socket,
        peer: str,
        limits: Limits,
        on_connection: Callable[[TcprosConnection], None],
    ) -> None:
        sock.setblocking(False)
        self.peer = peer
        self._sock = sock
        self._limit_s = limits.handshake_s
        self._on_connection = on_connection
        self._reader = HeaderReader(limits.header_bytes)
        self._leave: Callable[[], None] = _nothing

    def wait(self, loop: asyncio.AbstractEventLoop, on_end: Callable[[_Greeting], None]) -> None:
        """Has the loop read on, up to a deadline, and `on_end` called when there is nothing left to read."""
        deadline = loop.call_later(self._limit_s, self.dismiss)
        number = self._sock.fileno()  # to register a socket itself would cost its repr

        def leave() -> None:
            deadline.cancel()
            loop.remove_reader(number)
            on_end(self)

        self._leave = leave
        loop.add_reader(number, self.read)

    def dismiss(self) -> None:
        """Closes the connection without an answer."""
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
            self._on_connection(TcprosConnection(self._sock, fields, self._reader.rest, self.peer))
        elif data:
            return False
        else:
            self.dismiss()
        return True


def _nothing() -> None:
    pass


async def connect(
    host: str, port: int, fields: Mapping[str, str], *, no_delay: bool = True, limits: Limits | None = None
) -> TcprosConnection:
    """Connects to a TCPROS server, sends `fields`, and returns with the peer's answer.

    Raises:
        Unreachable: no process listens there, or there was no answer within `Limits.handshake_s`.
        ProtocolError: the peer closed without an answer, or its answer is malformed.
    """
    loop = asyncio.get_running_loop()
    bounds = limits or process_limits()

    async def shake_hands() -> TcprosConnection:
        sock = await _connect_first(loop, host, port)
        try:
            sockets.prepare(sock, no_delay=no_delay)
            await loop.sock_sendall(sock, encode_header(fields))
            answer, rest = await _read_header(sock, bounds.header_bytes)
        except BaseException:
            sock.close()
            raise
        return TcprosConnection(sock, answer, rest)

    try:
        return await asyncio.wait_for(shake_hands(), bounds.handshake_s)
    except asyncio.TimeoutError:
        raise Unreachable(f"{host}:{port}", f"no answer within {bounds.handshake_s:g} s") from None
    except OSError as error:
        raise Unreachable(f"{host}:{port}", reason_of(error)) from error


def refuse_connection(sock: socket.socket, reason: str) -> None:
    """Sends a peer the reason for a refusal, if its socket takes it at once, and closes."""
    with contextlib.suppress(OSError):
        sock.send(encode_header(refuse(reason)))
    sock.close()


async def _connect_first(loop: asyncio.AbstractEventLoop, host: str, port: int) -> socket.socket:
    """A connection to the first address of the host that takes one."""
    failure: OSError = OSError("the name has no address")
    for family, kind, protocol, _, address in await _addresses(loop, host, port):
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


async def _addresses(
    loop: asyncio.AbstractEventLoop, host: str, port: int
) -> Sequence[tuple[int, int, int, str, Any]]:
    """The addresses of a host. Only names are looked up in a thread, where they may wait for each other."""
    with contextlib.suppress(socket.gaierror):
        return socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_NUMERICHOST)
    return await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM)


async def _read_header(sock: socket.socket, limit_bytes: int) -> tuple[Mapping[str, str], bytes]:
    loop = asyncio.get_running_loop()
    reader = HeaderReader(limit_bytes)
    while True:
        data = await loop.sock_recv(sock, _CHUNK_BYTES)
        if not data:
            raise ProtocolError("the peer closed the connection before it said who it is")
        fields = reader.feed(data)
        if fields is not None:
            return fields, reader.rest
