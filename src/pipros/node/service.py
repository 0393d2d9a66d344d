"""Services: a server that answers calls over TCPROS, and a client that makes them.

Wire form of a reply: one byte, 1 for success, then a frame with the response, or with the text
of the error. Source: http://wiki.ros.org/ROS/TCPROS
"""

from __future__ import annotations

import contextlib
import logging
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import urlsplit

from pipros.errors import PiprosError, ProtocolError, Refused
from pipros.net import sockets
from pipros.net.tcpros import HANDSHAKE_DEADLINE_S, Connection
from pipros.node.publisher import body_buffers
from pipros.node.subscriber import decoder
from pipros.wire.frames import FrameBuffer
from pipros.wire.handshake import (
    Interface,
    accept_service_link,
    check_service_reply,
    check_service_request,
    refuse,
    request_service_link,
)
from pipros.wire.header import HeaderReader, encode_header

if TYPE_CHECKING:
    from pipros.msg.base import Message

_pack_length = struct.Struct("<I").pack
_pack_reply = struct.Struct("<BI").pack


class ServiceClass(Protocol):
    """What a generated service type offers: `std_srvs.srv.Empty` for example."""

    _type: str
    _md5sum: str
    _request_class: type[Message]
    _response_class: type[Message]


class ServiceFailed(PiprosError):
    """A service call brought no response: nobody there, refused, answered with an error, or broken."""


class CallTimeout(ServiceFailed):
    """A service call took longer than it was given."""


class HandlerError(Exception):
    """Raised by a handler's adapter: the text goes to the client without a log entry here."""


class ServiceServer:
    """Answers the calls of one service, each connection in a thread of its own.

    `handler` gets the request and returns the response; it may block. When it raises, the client
    gets the text, and `on_error` is told.
    """

    def __init__(
        self,
        name: str,
        service_class: ServiceClass,
        handler: Callable[[Any], Message],
        *,
        caller_id: str,
        on_error: Callable[[BaseException], object],
        log: logging.Logger,
    ) -> None:
        self.name = name
        self.service_class = service_class
        self.interface = Interface(service_class._type, service_class._md5sum)
        self.calls = 0
        self._handler = handler
        self._on_error = on_error
        self._caller_id = caller_id
        self._log = log
        self._decode = decoder(service_class._request_class)
        self._open: set[socket.socket] = set()
        self._is_closed = False

    def attach(self, connection: Connection) -> None:
        """Takes over a connection whose header names this service."""
        threading.Thread(
            target=self._serve, args=(connection,), name=f"service {self.name}", daemon=True
        ).start()

    def close(self) -> None:
        """Ends all connections; a handler under way ends by itself."""
        self._is_closed = True
        for sock in list(self._open):
            sockets.abort(sock)

    def _serve(self, connection: Connection) -> None:
        sock, fields = connection.sock, connection.fields
        self._open.add(sock)
        try:
            sock.setblocking(True)
            refusal = check_service_request(fields, self.interface)
            if refusal or self._is_closed:
                sock.sendall(encode_header(refuse(refusal or f"[{self.name}] is being closed")))
                return
            sock.sendall(
                encode_header(
                    accept_service_link(
                        self.name,
                        self._caller_id,
                        self.interface,
                        request_type=self.service_class._request_class._type,
                        response_type=self.service_class._response_class._type,
                    )
                )
            )
            if fields.get("probe") == "1":
                return
            for frame in receive_frames(sock, connection.rest):
                if not self._answer(sock, frame, fields) or fields.get("persistent") != "1":
                    return
        except (OSError, ProtocolError):
            pass  # the client has gone, or talks garbage: its connection ends, others go on
        finally:
            self._open.discard(sock)
            sock.close()

    def _answer(self, sock: socket.socket, frame: memoryview, fields: Mapping[str, str]) -> bool:
        """Handles one call; False when the request was no request, and the link is to end."""
        try:
            request = self._decode(frame)
        except Exception as error:
            self._log.error("service [%s]: cannot read a request: %s", self.name, error)
            return False
        request._connection_header = fields
        self.calls += 1
        try:
            reply = body_buffers(self._handler(request))
        except HandlerError as error:
            return self._send_error(sock, f"service cannot process request: {error}")
        except Exception as error:
            self._on_error(error)
            return self._send_error(sock, f"error processing request: {error}")
        sock.sendall(b"".join((_pack_reply(1, sum(map(len, reply))), *reply)))
        return True

    def _send_error(self, sock: socket.socket, text: str) -> bool:
        body = text.encode()
        sock.sendall(_pack_reply(0, len(body)) + body)
        return True


class ServiceLink:
    """A client's connection to a service server. One call at a time; not for several threads."""

    def __init__(
        self,
        uri: str,
        service: str,
        caller_id: str,
        interface: Interface,
        *,
        deadline: float | None,
        persistent: bool = False,
        probe: bool = False,
        extra: Mapping[str, str] | None = None,
    ) -> None:
        """Connects and shakes hands.

        Raises:
            ServiceFailed: nobody answers at `uri`, or the server refuses.
        """
        host, port = split_service_uri(uri)
        try:
            self.sock = socket.create_connection((host, port), _remaining(deadline, HANDSHAKE_DEADLINE_S))
        except OSError as error:
            raise ServiceFailed(f"unable to connect to service: {error}") from error
        try:
            sockets.prepare(self.sock)
            header = request_service_link(
                service, caller_id, interface, persistent=persistent, probe=probe, extra=extra
            )
            self.sock.settimeout(_remaining(deadline, HANDSHAKE_DEADLINE_S))
            self.sock.sendall(encode_header(header))
            self.fields, self._rest = _read_header(self.sock)
            check_service_reply(self.fields, f"{host}:{port}")
        except Refused as error:
            self.sock.close()
            raise ServiceFailed(
                f"unable to connect to service: remote error reported: {error.text}"
            ) from error
        except (OSError, ProtocolError) as error:
            self.sock.close()
            raise ServiceFailed(f"unable to connect to service: {error}") from error

    def call(self, service: str, request: Message, deadline: float | None) -> bytes:
        """Sends a request and returns the body of the response.

        Raises:
            CallTimeout: the deadline (of `time.monotonic`) passed; the link is closed.
            ServiceFailed: the server answered with an error, or the connection broke.
        """
        body = body_buffers(request)
        try:
            self.sock.settimeout(_remaining(deadline))
            self.sock.sendall(b"".join((_pack_length(sum(map(len, body))), *body)))
            ok = self._receive(1, deadline)[0]
            (length,) = struct.unpack("<I", self._receive(4, deadline))
            reply = self._receive(length, deadline)
        except TimeoutError as error:
            self.close()
            raise CallTimeout(f"service [{service}] did not answer in time") from error
        except (OSError, ProtocolError) as error:
            self.close()
            raise ServiceFailed(f"transport error completing service call: {error}") from error
        if not ok:
            raise ServiceFailed(f"service [{service}] responded with an error: {reply!r}")
        return reply

    def close(self) -> None:
        sockets.abort(self.sock)
        self.sock.close()

    def _receive(self, count: int, deadline: float | None) -> bytes:
        """Exactly `count` bytes; memory grows with what arrives, not with what was announced."""
        parts = [self._rest[:count]]
        self._rest = self._rest[count:]
        missing = count - len(parts[0])
        while missing:
            self.sock.settimeout(_remaining(deadline))
            data = self.sock.recv(min(missing, 1 << 20))
            if not data:
                raise ProtocolError("unable to receive data from sender, check sender's logs for details")
            parts.append(data)
            missing -= len(data)
        return b"".join(parts)


def probe_service(uri: str, service: str, caller_id: str, timeout_s: float) -> None:
    """Asks whether a service server really answers at `uri`; raises ServiceFailed if not."""
    deadline = time.monotonic() + timeout_s
    ServiceLink(uri, service, caller_id, Interface("*", "*"), deadline=deadline, probe=True).close()


def split_service_uri(uri: str) -> tuple[str, int]:
    """Host and port of `rosrpc://host:port`."""
    with contextlib.suppress(ValueError):
        parts = urlsplit(uri)
        if parts.scheme == "rosrpc" and parts.hostname and parts.port:
            return parts.hostname, parts.port
    raise ServiceFailed(f"protocol error: [{uri}] is no rosrpc URI")


def receive_frames(sock: socket.socket, first: bytes) -> Iterator[memoryview]:
    """The frames that come over a blocking socket, until its end; `first` came before."""
    buffer = FrameBuffer()
    data = memoryview(first)
    while data:
        room = buffer.room()
        count = min(len(room), len(data))
        room[:count] = data[:count]
        data = data[count:]
        yield from buffer.received(count)
    while count := sock.recv_into(buffer.room()):
        yield from buffer.received(count)


def _read_header(sock: socket.socket) -> tuple[Mapping[str, str], bytes]:
    reader = HeaderReader()
    while True:
        data = sock.recv(16 * 1024)
        if not data:
            raise ProtocolError("the server closed the connection before it answered")
        fields = reader.feed(data)
        if fields is not None:
            return fields, reader.rest


def _remaining(deadline: float | None, longest_s: float | None = None) -> float | None:
    """Seconds until the deadline, for a socket's time limit; raises TimeoutError when it has passed."""
    if deadline is None:
        return longest_s
    remaining = deadline - time.monotonic()
    if remaining <= 0:
        raise TimeoutError("the time is over")
    return remaining if longest_s is None else min(remaining, longest_s)
