"""Call services over TCPROS.

Source: http://wiki.ros.org/ROS/TCPROS
"""

from __future__ import annotations

import contextlib
import itertools
import socket
import struct
import threading
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from pipros.basics.errors import Interrupted, PiprosError, ProtocolError, Refused
from pipros.basics.limits import Limits, process_limits
from pipros.basics.printable import printable
from pipros.basics.uri import split_uri
from pipros.net import sockets
from pipros.net.busy_poll import REPLY_POLL_S, PollingReceiver
from pipros.net.connect import Connector
from pipros.net.master_client import MasterClient
from pipros.node.codec import decoder, encoder, number
from pipros.node.open_calls import OpenCalls
from pipros.node.service_server import ServiceClass
from pipros.wire.handshake import WireType, check_service_reply, request_service_link
from pipros.wire.header import HeaderReader, encode_header
from pipros.wire.messages import ReplyReader

if TYPE_CHECKING:
    from pipros.msg.base import Message

_pack_length = struct.Struct("<I").pack
_HEADER_CHUNK_BYTES = 16 * 1024
_CHUNK_BYTES = 64 * 1024
_LARGEST_CHUNK_BYTES = 4 * 1024 * 1024
EARLY_LIMIT_S = 0.05
"""Maximum time for connecting to the server of the last call before the master's response is read."""

PROBE_INTERVAL_S = 0.3
PROBE_LIMIT_S = 10.0
"""Interval between probes while waiting for a service, and the maximum duration of one probe."""


class ServiceFailed(PiprosError):
    """A service call failed.

    No server was found, the server refused the call or replied with an error, the call timed out, or the
    connection broke.
    """


class ErrorReply(ServiceFailed):
    """A server replied with an error.

    Attributes:
        text: the error as the server sent it; invalid UTF-8 is replaced.
    """

    def __init__(self, service: str, reply: bytes) -> None:
        super().__init__(f"service [{service}] responded with an error: {reply!r}")
        self.text = reply.decode("utf-8", "replace")


class CallTimeout(ServiceFailed):
    """A service call exceeded its timeout."""


class ServiceClient:
    """Calls one service. Each call has its own connection, unless the client is persistent."""

    def __init__(
        self,
        service: str,
        service_class: ServiceClass,
        *,
        master: Callable[[], MasterClient],
        calls: OpenCalls,
        persistent: bool = False,
        headers: Mapping[str, str] | None = None,
        limits: Limits | None = None,
    ) -> None:
        """Store the settings; the first call connects.

        Args:
            service: the global name.
            service_class: the service class.
            master: the master that is queried for the service's URI.
            calls: the group of running calls to which this client's calls are added, so that all can be
                interrupted together.
            persistent: whether to keep one connection for all calls.
            headers: extra connection header fields, which the service handler can read.
            limits: limits on the resources that the server can use; defaults to the process-wide limits.
        """
        self._limits = limits
        self.calls = OpenCalls(part_of=calls)
        self.service = service
        self.uri: str | None = None  # the server's URI at the last call
        self._expected_uri: str | None = None  # the URI to which the next call connects early
        self._interface = WireType(service_class._type, service_class._md5sum)
        self._decode = decoder(service_class._response_class)
        self._master = master
        self._persistent = persistent
        self._headers = headers
        self._numbers = itertools.count(1)
        # Shared by all connections, because it learns whether servers respond immediately.
        self._poller = PollingReceiver(REPLY_POLL_S)
        self._kept: ServiceLink | None = None
        self._kept_lock = threading.Lock()  # held while the kept link is used

    def call(self, request: Message, timeout_s: float | None = None) -> Any:
        """Send the request and return the response.

        Raises:
            CallTimeout: there was no response within `timeout_s`.
            ErrorReply: the server replied with an error.
            ServiceFailed: no server was found, the server refused the call, or the connection broke.
            SerializationError: a value in the request does not fit its field. The request was not sent.
        """
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        number(request, next(self._numbers))
        if not self._persistent:
            link = self._connect(deadline)
            try:
                return self._response(link, link.call(self.service, request, deadline))
            finally:
                link.close()
        with self._kept_lock:
            if self._kept is None or self._kept.is_closed:  # the link is broken; connect again
                self._kept = self._connect(deadline)
            link = self._kept
            body = link.call(self.service, request, deadline)
        return self._response(link, body)

    def _response(self, link: ServiceLink, body: bytes) -> Any:
        response = self._decode(body)
        response._connection_header = link.fields
        return response

    def probe(self, timeout_s: float) -> None:
        """Check that a server responds; raise ServiceFailed if it does not."""
        deadline = time.monotonic() + timeout_s
        interface = WireType("*", "*")
        link = ServiceLink(
            self._look_up(),
            self.service,
            self._master().caller_id,
            interface,
            deadline=deadline,
            probe=True,
            poller=self._poller,
            calls=self.calls,
            limits=self._limits,
        )
        link.close()

    def wait_until_available(
        self,
        timeout_s: float | None,
        *,
        pause: Callable[[float], object],
        report: Callable[[ServiceFailed], object],
    ) -> bool:
        """Probe until a server responds. Return False if none does within `timeout_s`.

        If `timeout_s` is None, wait forever.

        Args:
            pause: called with the number of seconds until the next probe; an exception that it raises ends
                the wait.
            report: called once, when a registered server first fails to respond.
        """
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        has_reported = False
        while True:
            left_s = PROBE_LIMIT_S if deadline is None else deadline - time.monotonic()
            if left_s <= 0:
                return False
            try:
                self.probe(min(left_s, PROBE_LIMIT_S))
            except ServiceFailed as error:
                if not has_reported and "unavailable" not in str(error):
                    has_reported = True
                    report(error)
            else:
                return True
            pause(min(PROBE_INTERVAL_S, left_s))

    @property
    def kept(self) -> ServiceLink | None:
        """The open connection of a persistent client; None before its first call."""
        return self._kept

    def close(self) -> None:
        """Close the connection of a persistent client. A later call connects again."""
        kept, self._kept = self._kept, None
        if kept is not None:
            kept.close()

    def _look_up(self, meanwhile: Callable[[], None] | None = None) -> str:
        try:
            return self._master().lookup_service(self.service, meanwhile)
        except Refused:
            raise ServiceFailed(f"service [{self.service}] unavailable") from None
        except ServiceFailed:  # from `meanwhile`
            raise
        except PiprosError as error:
            raise ServiceFailed(f"unable to contact master: {error}") from error

    def _connect(self, deadline: float | None) -> ServiceLink:
        """Look up the server and connect to it.

        The server is usually that of the last call. The client therefore connects to it again while it waits
        for the master, but uses this link only if the master returns the same URI.
        """
        # Extra header fields may be secrets, which only the server that the master names should receive.
        expected = None if self._persistent or self._headers else self._expected_uri
        early: ServiceLink | None = None

        def connect_early() -> None:
            nonlocal early
            soon = time.monotonic() + EARLY_LIMIT_S
            if expected is not None and early is None:
                try:
                    early = self._link(expected, soon if deadline is None else min(soon, deadline))
                except ServiceFailed as error:
                    if isinstance(error.__cause__, Interrupted):
                        raise

        try:
            self.uri = uri = self._look_up(connect_early)
        except BaseException:
            self._expected_uri = None
            if early is not None:
                early.close()
            raise
        # A server that did not respond soon enough is not tried early in the next call.
        self._expected_uri = None if expected is not None and early is None else uri
        if early is not None:
            if uri == expected and sockets.is_idle(early.sock):
                return early
            early.close()
        return self._link(uri, deadline)

    def _link(self, uri: str, deadline: float | None) -> ServiceLink:
        return ServiceLink(
            uri,
            self.service,
            self._master().caller_id,
            self._interface,
            deadline=deadline,
            persistent=self._persistent,
            extra=self._headers,
            poller=self._poller,
            calls=self.calls,
            limits=self._limits,
        )


class ServiceLink:
    """A client's connection to a service server.

    It handles one call at a time, and must not be shared between threads.
    """

    def __init__(
        self,
        uri: str,
        service: str,
        caller_id: str,
        interface: WireType,
        *,
        deadline: float | None,
        persistent: bool = False,
        probe: bool = False,
        extra: Mapping[str, str] | None = None,
        poller: PollingReceiver | None = None,
        calls: OpenCalls | None = None,
        limits: Limits | None = None,
    ) -> None:
        """Connect and exchange headers.

        Args:
            uri: the URI of the server, `rosrpc://host:port`.
            service: the global name.
            caller_id: the name of the calling node.
            interface: the type and md5 sum that the server must have; `*` accepts any.
            deadline: `time.monotonic()` time by which the connection and header exchange must finish.
            persistent: whether to ask the server to keep the connection open for further calls.
            probe: whether to tell the server that no call will follow.
            extra: further fields for the connection header.
            poller: decides whether to busy-poll, and adapts to the observed response times.
            calls: the group of running calls that includes the link until it is closed.
            limits: limits on the resources that the server can use; defaults to the process-wide limits.

        Raises:
            CallTimeout: the deadline passed.
            ServiceFailed: the server is unreachable or rejected the connection, or the call was interrupted.
        """
        self._poller = poller or PollingReceiver(REPLY_POLL_S)
        self._calls = calls or OpenCalls()
        self._connector = Connector()
        self._is_connected = False
        self._is_busy = True
        self.sock: socket.socket
        self._limits = limits or process_limits()
        host, port = split_service_uri(uri)
        self._calls.add(self)
        try:
            self._connect(host, port, deadline)
            header = request_service_link(
                service, caller_id, interface, persistent=persistent, probe=probe, extra=extra
            )
            self.fields, rest = self._exchange_headers(header, deadline)
            self._replies = ReplyReader(self._limits.frame_bytes)
            self._replies.feed(rest)
            check_service_reply(self.fields, f"{host}:{port}")
        except Refused as error:
            self.close()
            raise ServiceFailed(
                f"unable to connect to service: remote error reported: {error.text}"
            ) from error
        except (OSError, ProtocolError, Interrupted) as error:
            self.close()
            cause = Interrupted("the call was interrupted") if self._connector.is_interrupted else error
            raise _cannot_connect(service, cause, deadline) from cause
        except BaseException:
            self.close()
            raise
        self._is_busy = False

    def call(self, service: str, request: Message, deadline: float | None) -> bytes:
        """Send a request and return the body of the response.

        Raises:
            CallTimeout: the deadline (a `time.monotonic()` time) passed; the link is closed.
            ServiceFailed: the server replied with an error, or the connection broke.
        """
        body = encoder(type(request))(request)
        self._is_busy = True
        try:
            self.sock.settimeout(_remaining(deadline))
            self.sock.sendall(b"".join((_pack_length(sum(map(len, body))), *body)))
            self.sock.settimeout(None)
            ok, reply = self._receive_reply(deadline)
        except TimeoutError as error:
            self.close()
            raise CallTimeout(f"service [{service}] did not answer in time") from error
        except (OSError, ProtocolError) as error:
            self.close()
            raise ServiceFailed(f"transport error completing service call: {error}") from error
        finally:
            self._is_busy = False
        if not ok:
            raise ErrorReply(service, reply)
        return reply

    def _connect(self, host: str, port: int, deadline: float | None) -> None:
        self.sock = self._connector.connect(host, port, deadline, self._limits.handshake_s)
        self._is_connected = True
        if self._connector.is_interrupted:  # `interrupt` may have missed the socket
            raise Interrupted("the call was interrupted")
        sockets.prepare(self.sock)

    def _exchange_headers(
        self, header: Mapping[str, str], deadline: float | None
    ) -> tuple[Mapping[str, str], bytes]:
        """Send a connection header. Return the server's header and the bytes that were received after it."""
        self.sock.settimeout(_remaining(deadline, self._limits.handshake_s))
        self.sock.sendall(encode_header(header))
        self.sock.settimeout(None)
        reader = HeaderReader(self._limits.header_bytes)
        last = time.monotonic() + self._limits.handshake_s
        deadline = last if deadline is None else min(deadline, last)
        while True:
            data = self._poller.receive(self.sock, _HEADER_CHUNK_BYTES, deadline)
            if not data:
                raise ProtocolError("the server closed the connection before it sent a header")
            fields = reader.feed(data)
            if fields is not None:
                return fields, reader.rest

    def _receive_reply(self, deadline: float | None) -> tuple[bool, bytes]:
        """Return whether the call succeeded, and the response or the error text."""
        replies = self._replies
        while (reply := replies.next_reply()) is None:
            most = min(max(replies.missing_bytes, _CHUNK_BYTES), _LARGEST_CHUNK_BYTES)
            more = self._poller.receive(self.sock, most, deadline)
            if not more:
                raise ProtocolError("unable to receive data from sender, check sender's logs for details")
            replies.feed(more)
        return reply

    def interrupt(self) -> None:
        """Interrupt a call that is running in another thread, in any phase."""
        self._connector.interrupt()
        if self._is_connected:
            sockets.abort(self.sock)

    def interrupt_present(self) -> None:
        """Interrupt a running call. An idle link, which is kept for the next call, stays open."""
        if self._is_busy:
            self.interrupt()

    @property
    def is_closed(self) -> bool:
        return self.sock.fileno() < 0

    def close(self) -> None:
        self._calls.remove(self)
        if self._is_connected:
            sockets.abort(self.sock)
            self.sock.close()


def split_service_uri(uri: str) -> tuple[str, int]:
    """Return the host and port of `rosrpc://host:port`. Raises ServiceFailed for any other URI."""
    with contextlib.suppress(ValueError):
        host, port, _ = split_uri(uri, ["rosrpc"])
        if port:
            return host, port
    raise ServiceFailed(
        f"protocol error: a service URI must have the form rosrpc://HOST:PORT, got [{printable(uri)}]"
    )


def _cannot_connect(service: str, error: Exception, deadline: float | None) -> ServiceFailed:
    if deadline is not None and time.monotonic() >= deadline:
        return CallTimeout(f"service [{service}] did not answer in time")
    return ServiceFailed(f"unable to connect to service: {error}")


def _remaining(deadline: float | None, longest_s: float | None = None) -> float | None:
    """Return the number of seconds until the deadline, as a socket timeout.

    Raises TimeoutError if it has passed.
    """
    if deadline is None:
        return longest_s
    remaining = deadline - time.monotonic()
    if remaining <= 0:
        raise TimeoutError("the deadline has passed")
    return remaining if longest_s is None else min(remaining, longest_s)
