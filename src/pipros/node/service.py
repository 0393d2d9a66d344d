"""Serving: a server that answers the calls of one service over TCPROS.

Wire form of a reply: one byte, 1 for success, then a frame with the response, or with the text
of the error. Source: http://wiki.ros.org/ROS/TCPROS
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from pipros.errors import ProtocolError
from pipros.net import sockets
from pipros.net.lookout import ANSWER_LOOK_S, Lookout
from pipros.net.tcpros import Connection, refuse_connection
from pipros.node.context import NodeContext
from pipros.node.publisher import encoder
from pipros.node.subscriber import decoder
from pipros.node.workers import Workers
from pipros.wire.frames import FrameBuffer
from pipros.wire.handshake import (
    Interface,
    accept_service_link,
    check_service_request,
)
from pipros.wire.header import encode_header

if TYPE_CHECKING:
    from pipros.msg.base import Message

_pack_reply = struct.Struct("<BI").pack


class ServiceClass(Protocol):
    """What a generated service type offers: `std_srvs.srv.Empty` for example."""

    _type: str
    _md5sum: str
    _request_class: type[Message]
    _response_class: type[Message]


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
        context: NodeContext,
        *,
        on_error: Callable[[BaseException], object],
        workers: Workers,
    ) -> None:
        self.name = name
        self.service_class = service_class
        self.interface = Interface(service_class._type, service_class._md5sum)
        self.calls = 0
        self._handler = handler
        self._on_error = on_error
        self._context = context
        self._workers = workers
        self._decode = decoder(service_class._request_class)
        self._encode = encoder(service_class._response_class)
        self._open: set[socket.socket] = set()
        self._is_closed = False

    def attach(self, connection: Connection) -> None:
        """Takes over a connection whose header names this service: answers it, and has it served.

        Called in the event loop, which answers at once, while a thread gets ready for the request.
        """
        refusal = check_service_request(connection.fields, self.interface)
        if refusal:
            refuse_connection(connection.sock, refusal)
            return
        answer = encode_header(
            accept_service_link(
                self.name,
                self._context.node_name,
                self.interface,
                request_type=self.service_class._request_class._type,
                response_type=self.service_class._response_class._type,
            )
        )
        try:
            sent = connection.sock.send(answer)
        except OSError:  # it left while it was being answered
            connection.sock.close()
            return
        if connection.fields.get("probe") == "1":
            connection.sock.close()
            return
        self._open.add(connection.sock)
        if self._is_closed:  # and `close` may not have seen this connection
            sockets.abort(connection.sock)
        try:
            self._workers.run(self._serve, connection, answer[sent:])
        except RuntimeError as error:  # no more threads: rather no answer at all than one to wait for
            self._context.log.error("service [%s]: cannot serve a call: %s", self.name, error)
            self._open.discard(connection.sock)
            connection.sock.close()

    def close(self) -> None:
        """Ends all connections; a handler under way ends by itself."""
        self._is_closed = True
        for sock in list(self._open):
            sockets.abort(sock)

    def _serve(self, connection: Connection, unsent: bytes) -> None:
        sock, fields = connection.sock, connection.fields
        try:
            sock.setblocking(True)
            sock.sendall(unsent)
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
            self._context.log.error("service [%s]: cannot read a request: %s", self.name, error)
            return False
        request._connection_header = fields
        self.calls += 1
        try:
            reply = self._encode(self._handler(request))
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
    lookout = Lookout(ANSWER_LOOK_S)
    while count := lookout.receive_into(sock, buffer.room()):
        yield from buffer.received(count)
