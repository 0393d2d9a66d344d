"""A server that answers calls to one service over TCPROS.

On the wire, a reply is one byte (1 for success, 0 for failure), followed by the length and the bytes of the
response or of the error text.
Source: http://wiki.ros.org/ROS/TCPROS
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from pipros.basics.budget import Slots
from pipros.net.connection_table import WHOLE_REQUEST_S
from pipros.net.held_bytes import HeldBytes
from pipros.net.tcpros import TcprosConnection, refuse_connection
from pipros.net.workers import Workers, interpreter_ends
from pipros.node.codec import decoder, encoder, number
from pipros.node.context import NodeContext
from pipros.node.service_connection import Reply, ServiceConnection
from pipros.node.throttled_warnings import ThrottledWarnings
from pipros.wire.handshake import (
    WireType,
    accept_service_link,
    service_refusal,
)
from pipros.wire.header import encode_header

if TYPE_CHECKING:
    from pipros.msg.base import Message


class ServiceClass(Protocol):
    """A generated service class, for example `std_srvs.srv.Empty`."""

    @property
    def _type(self) -> str: ...
    @property
    def _md5sum(self) -> str: ...
    @property
    def _request_class(self) -> type[Message]: ...
    @property
    def _response_class(self) -> type[Message]: ...


class HandlerError(Exception):
    """Raised by code that wraps a user's handler.

    The text is sent to the client, but `on_error` is not called.
    """


class CallFailed(Exception):
    """Raised by a handler. The client gets a failure with no error text, as from a roscpp handler."""


class ServiceServer:
    """Answers calls to one service. Calls on different connections run concurrently, in threads.

    `handler` receives the request and returns the response; it may block. If `handler` raises, the error text
    is sent to the client, and `on_error` is called.
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
        waiting_threads: Slots,
        unread: HeldBytes,
    ) -> None:
        self.name = name
        self.service_class = service_class
        self.interface = WireType(service_class._type, service_class._md5sum)
        self.calls = 0
        self._numbers = itertools.count(1)
        self._handler = handler
        self._on_error = on_error
        self._context = context
        self._workers = workers
        self._decode = decoder(service_class._request_class)
        self._encode = encoder(service_class._response_class)
        self._malformed = ThrottledWarnings(
            context.log, context.loop, f"service [{name}]: cannot read %d more requests; the last: %s"
        )
        self._open: set[ServiceConnection] = set()
        self.loop = context.loop
        self.connections = context.connections
        self.waiting_threads = waiting_threads
        self.unread = unread
        self.incomplete = context.incomplete
        self.request_s = WHOLE_REQUEST_S
        self.frame_bytes = context.limits.frame_bytes
        self.is_closed = False

    def attach(self, connection: TcprosConnection) -> None:
        """Take over a connection whose header names this service: send the reply header, then serve calls.

        Called from the event loop, which replies at once while a thread prepares for the request.
        """
        refusal = service_refusal(connection.fields, self.interface)
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
        is_probe = connection.fields.get("probe") == "1"
        served = ServiceConnection(connection, self)
        if not is_probe and not self.connections.add(served):
            refuse_connection(connection.sock, f"[{self._context.node_name}] has too many connections")
            return
        try:
            sent = connection.sock.send(answer)
        except OSError:  # the client disconnected during the reply
            is_probe = True
        if is_probe:
            served.close()
            return
        self._open.add(served)
        if self.is_closed:  # `close` may have run before the connection was added
            served.end()
        served.start(answer[sent:])

    def close(self, *, answers_running: bool = False) -> None:
        """Close all connections. A running handler is not interrupted.

        Args:
            answers_running: whether clients on this machine still get the replies of running calls.
        """
        self.is_closed = True
        for connection in list(self._open):
            (connection.abort if answers_running else connection.end)()

    # -- called by connections --------------------------------------------------------

    def run(self, serve: Callable[[], None]) -> bool:
        """Call `serve` in a worker thread; log an error and return False if the system cannot start one."""
        try:
            self._workers.run(serve)
        except RuntimeError as error:
            # close the link, so that the client does not wait for a reply that never arrives
            if not interpreter_ends(error):
                self._context.log.error("service [%s]: cannot serve a call: %s", self.name, error)
            return False
        return True

    def answer(self, data: memoryview | bytes, fields: Mapping[str, str]) -> Reply | None:
        """Handle one call. Return None if the request was malformed; the link must then be closed."""
        try:
            request = self._decode(data)
        except Exception as error:
            self.loop.call(self._report_malformed, str(error))
            return None
        request._connection_header = fields
        self.calls += 1
        try:
            response = self._handler(request)
            number(response, next(self._numbers))
            return True, self._encode(response)
        except CallFailed:
            return False, (b"",)
        except HandlerError as error:
            return False, (_text_of("service cannot process request", error),)
        except Exception as error:
            text = _text_of("error processing request", error)
            try:
                self._on_error(error)
            except Exception:
                self._context.log.exception("the error handler of service [%s] failed", self.name)
            return False, (text,)

    def forget(self, connection: ServiceConnection) -> None:
        self._open.discard(connection)

    def _report_malformed(self, error: str) -> None:
        if self._malformed.should_log(error):
            self._context.log.error("service [%s]: cannot read a request: %s", self.name, error)


def _text_of(what: str, error: BaseException) -> bytes:
    """Return an exception's text for the client.

    File names in the text may contain bytes that are not valid UTF-8.
    """
    try:
        return f"{what}: {error}".encode("utf-8", "backslashreplace")
    except Exception:  # the exception's __str__ raises
        return f"{what}: {type(error).__name__}".encode()
