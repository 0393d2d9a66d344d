"""A client's connection to a service server: connect, exchange headers, send requests and receive replies.

Source: http://wiki.ros.org/ROS/TCPROS
"""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

from pipros.basics.errors import Interrupted, PiprosError, ProtocolError, Refused
from pipros.basics.limits import Limits, process_limits
from pipros.basics.printable import printable
from pipros.basics.uri import split_uri
from pipros.net import local_stream, sockets
from pipros.net.busy_poll import REPLY_POLL_S, PollingReceiver
from pipros.net.connect import Connector
from pipros.net.unreachable import advice_on
from pipros.node.codec import encoder
from pipros.node.open_calls import OpenCalls
from pipros.wire.handshake import HANDSHAKE_S, WireType, check_service_reply, request_service_link
from pipros.wire.header import HEADER_BYTES, HeaderReader, encode_header
from pipros.wire.messages import ReplyReader

if TYPE_CHECKING:
    from pipros.msg.base import Message

_pack_length = struct.Struct("<I").pack
_HEADER_CHUNK_BYTES = 16 * 1024
_CHUNK_BYTES = 64 * 1024
_LARGEST_CHUNK_BYTES = 4 * 1024 * 1024


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


class NotDelivered(ServiceFailed):
    """The connection broke before the whole request was sent, so the server has not handled the call."""


class ServiceLink:
    """A client's connection to a service server.

    It handles one call at a time, and must not be shared between threads.

    Attributes:
        uri: the URI of the server.
        sock: the connection: a Unix stream if the server is a pipros node on this machine, otherwise TCP.
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
        self.uri = uri
        self.sock: socket.socket
        self._limits = limits or process_limits()
        host, port = split_service_uri(uri)
        self._calls.add(self)
        try:
            header = request_service_link(
                service, caller_id, interface, persistent=persistent, probe=probe, extra=extra
            )
            self.fields, rest = self._open(host, port, header, deadline)
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
            advice = "" if self._is_connected or cause is not error else advice_on(host, error)
            raise _cannot_connect(service, cause, deadline, advice) from cause
        except BaseException:
            self.close()
            raise
        self._is_busy = False

    def call(self, service: str, request: Message, deadline: float | None) -> bytes:
        """Send a request and return the body of the response.

        Raises:
            CallTimeout: the deadline (a `time.monotonic()` time) passed; the link is closed.
            NotDelivered: the connection broke before the whole request was sent.
            ServiceFailed: the server replied with an error, or the connection broke.
        """
        body = encoder(type(request))(request)
        self._is_busy = True
        is_sent = False
        try:
            self.sock.settimeout(_remaining(deadline))
            self.sock.sendall(b"".join((_pack_length(sum(map(len, body))), *body)))
            is_sent = True
            self.sock.settimeout(None)
            ok, reply = self._receive_reply(deadline)
        except TimeoutError as error:
            self.close()
            raise CallTimeout(f"service [{service}] did not answer in time") from error
        except (OSError, ProtocolError) as error:
            self.close()
            is_undelivered = not is_sent and not self._connector.is_interrupted
            failure = NotDelivered if is_undelivered else ServiceFailed
            raise failure(f"transport error completing service call: {error}") from error
        finally:
            self._is_busy = False
        if not ok:
            raise ErrorReply(service, reply)
        return reply

    def _open(
        self, host: str, port: int, header: Mapping[str, str], deadline: float | None
    ) -> tuple[Mapping[str, str], bytes]:
        """Connect and exchange headers. Return the result of `_exchange_headers`."""
        if local_stream.is_enabled():
            try:
                self._adopt(local_stream.connect(local_stream.name_of(self.uri)))
                return self._exchange_headers(header, deadline)
            except TimeoutError:
                raise
            except (OSError, ProtocolError):  # use TCP
                if self._is_connected:
                    self.sock.close()
        self._adopt(self._connector.connect(host, port, deadline, HANDSHAKE_S))
        sockets.prepare(self.sock)
        return self._exchange_headers(header, deadline)

    def _adopt(self, sock: socket.socket) -> None:
        self.sock = sock
        sockets.keep_from_children(sock)
        self._is_connected = True
        if self._connector.is_interrupted:  # `interrupt` may have run before the socket was stored
            raise Interrupted("the call was interrupted")

    def _exchange_headers(
        self, header: Mapping[str, str], deadline: float | None
    ) -> tuple[Mapping[str, str], bytes]:
        """Send a connection header. Return the server's header and the bytes that were received after it."""
        self.sock.settimeout(_remaining(deadline, HANDSHAKE_S))
        self.sock.sendall(encode_header(header))
        self.sock.settimeout(None)
        reader = HeaderReader(HEADER_BYTES)
        last = time.monotonic() + HANDSHAKE_S
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
            max_bytes = min(max(replies.missing_bytes, _CHUNK_BYTES), _LARGEST_CHUNK_BYTES)
            more = self._poller.receive(self.sock, max_bytes, deadline)
            if not more:
                raise ProtocolError("unable to receive data from sender, check sender's logs for details")
            replies.feed(more)
        return reply

    def interrupt(self) -> None:
        """Interrupt a call that is running in another thread, in any phase."""
        self._connector.interrupt()
        if self._is_connected:
            sockets.abort_blocked(self.sock)

    def interrupt_present(self) -> None:
        """Interrupt a running call. An idle link, which is kept for the next call, stays open."""
        if self._is_busy:
            self.interrupt()

    @property
    def is_closed(self) -> bool:
        return self.sock.fileno() < 0

    @property
    def is_kept_by_server(self) -> bool:
        """Whether the connection is a Unix stream, which the server keeps open for further calls."""
        return local_stream.is_local(self.sock)

    def close(self) -> None:
        self._calls.remove(self)
        if self._is_connected:
            sockets.abort_blocked(self.sock)
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


def _cannot_connect(service: str, error: Exception, deadline: float | None, advice: str) -> ServiceFailed:
    if deadline is not None and time.monotonic() >= deadline:
        return CallTimeout(f"service [{service}] did not answer in time{advice}")
    return ServiceFailed(f"unable to connect to service: {error}{advice}")


def _remaining(deadline: float | None, longest_s: float | None = None) -> float | None:
    """Return the number of seconds until the deadline, but at most `longest_s`, as a socket timeout.

    Raises TimeoutError if the deadline has passed.
    """
    if deadline is None:
        return longest_s
    remaining = deadline - time.monotonic()
    if remaining <= 0:
        raise TimeoutError("the deadline has passed")
    return remaining if longest_s is None else min(remaining, longest_s)
