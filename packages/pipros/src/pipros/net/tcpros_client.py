"""Connect to TCPROS servers, over TCP or a Unix stream, and exchange connection headers."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any

from pipros.basics.errors import ProtocolError, Unreachable
from pipros.net import local_stream, sockets
from pipros.net.address import address_here
from pipros.net.rpc_client import reason_of
from pipros.net.tcpros import CHUNK_BYTES, TcprosConnection
from pipros.net.timings import LINK_TIMINGS, LinkTimings
from pipros.wire.handshake import HANDSHAKE_S
from pipros.wire.header import HEADER_BYTES, HeaderReader, encode_header


async def connect(
    host: str,
    port: int,
    fields: Mapping[str, str],
    *,
    no_delay: bool = True,
    timings: LinkTimings = LINK_TIMINGS,
) -> TcprosConnection:
    """Connect to a TCPROS server, send `fields`, and return the connection with the peer's reply header.

    Raises:
        Unreachable: the connection failed, or the peer did not respond within `HANDSHAKE_S`.
        ProtocolError: the port is impossible, the peer closed the connection without a reply, or its reply is
            malformed.
    """

    async def open_socket() -> socket.socket:
        with sockets.closed_on_error(await _connect_first(asyncio.get_running_loop(), host, port)) as sock:
            sockets.prepare(sock, no_delay=no_delay, timings=timings)
            return sock

    if not 0 < port < 65536:
        raise ProtocolError(f"impossible address {host}:{port}: a port must be between 1 and 65535")
    return await _shake_hands(open_socket, f"{host}:{port}", fields)


async def connect_locally(
    name: str, fields: Mapping[str, str], *, shares_memory: bool = False
) -> TcprosConnection:
    """Connect like `connect`, but over a Unix stream to an abstract socket name.

    If `shares_memory` is true, the socket is a `DescriptorSocket`.
    """

    async def open_socket() -> socket.socket:
        sock = local_stream.connect(name)
        if not shares_memory:
            return sock
        from pipros.net.shared_receiver import DescriptorSocket

        return DescriptorSocket(sock)

    return await _shake_hands(open_socket, name, fields)


async def _shake_hands(
    open_socket: Callable[[], Awaitable[socket.socket]],
    peer: str,
    fields: Mapping[str, str],
) -> TcprosConnection:

    async def exchange() -> TcprosConnection:
        with sockets.closed_on_error(await open_socket()) as sock:
            await asyncio.get_running_loop().sock_sendall(sock, encode_header(fields))
            answer, rest = await _read_header(sock, HEADER_BYTES)
        return TcprosConnection(sock, answer, rest)

    try:
        return await asyncio.wait_for(exchange(), HANDSHAKE_S)
    except asyncio.TimeoutError:
        raise Unreachable(peer, f"no response within {HANDSHAKE_S:g} s") from None
    except OSError as error:
        raise Unreachable(peer, reason_of(error)) from error


async def _connect_first(loop: asyncio.AbstractEventLoop, host: str, port: int) -> socket.socket:
    """Return a socket connected to the first of the host's addresses that accepts a connection."""
    host, port = address_here(host, port)
    failure: OSError = OSError(f"the name {host} has no address")
    for family, kind, protocol, _, address in await _addresses(loop, host, port):
        try:
            with sockets.closed_on_error(socket.socket(family, kind, protocol)) as sock:
                sock.setblocking(False)
                await loop.sock_connect(sock, address)
        except OSError as error:
            failure = error
        else:
            return sock
    raise failure


async def _addresses(
    loop: asyncio.AbstractEventLoop, host: str, port: int
) -> Sequence[tuple[int, int, int, str, Any]]:
    """Return a host's addresses.

    Names are looked up in a limited number of threads. Addresses are returned unchanged.
    """
    with contextlib.suppress(socket.gaierror, UnicodeError):
        return socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_NUMERICHOST)
    return await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM)


async def _read_header(sock: socket.socket, limit_bytes: int) -> tuple[Mapping[str, str], bytes]:
    loop = asyncio.get_running_loop()
    reader = HeaderReader(limit_bytes)
    while True:
        data = await loop.sock_recv(sock, CHUNK_BYTES)
        if not data:
            raise ProtocolError("the peer closed the connection before it sent a header")
        fields = reader.feed(data)
        if fields is not None:
            return fields, reader.rest
