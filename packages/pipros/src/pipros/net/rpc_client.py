"""The blocking XML-RPC client. It does not import asyncio, so that tools start quickly.

`pipros.net.rpc_server.RpcServer` is the server for masters and nodes; `pipros.net.rpc_async_client` is the
asyncio client.
"""

from __future__ import annotations

import contextlib
import os
import socket
import threading
import time
from collections.abc import Callable
from typing import Any, Final

from pipros.basics.errors import Interrupted, LimitExceeded, ProtocolError, Unreachable
from pipros.basics.limits import process_limits
from pipros.net import sockets
from pipros.net.address import host_and_port, plain_address, split_uri
from pipros.net.busy_poll import REPLY_POLL_S, PollingReceiver
from pipros.net.connect import Connector
from pipros.wire.http import HttpError, Response, ResponseReader, build_request
from pipros.wire.xmlrpc import Fault, decode_response, encode_call

__all__ = ["Fault", "RpcClient"]

KEPT_CONNECTIONS: Final = 4
"""Number of idle connections that a client keeps open. If more calls run at the same time, the additional
connections are closed afterwards.
"""
TIMEOUT_OF_CLIENT: Final = -1.0
"""Sentinel for a call's `timeout_s`: use the client's timeout."""
CONNECT_LIMIT_S: Final = 15.0
"""Maximum time for connecting to one of the server's addresses if the call has no timeout."""
_READ_BYTES: Final = 65536
_KEPT_ADDRESSES: Final = 4
_GRACE_STEP_S: Final = 0.002


class RpcClient:
    """Calls methods on one XML-RPC server.

    Thread-safe: calls from different threads use different connections and do not wait for each other.
    Connections are kept open and reused.

    If the server closes a reused connection before it responds, the client sends the call once more over a
    new connection, as Python's and ROS's own clients do.

    Attributes:
        server_addresses: the server's IP addresses in recent connections, latest first.

    >>> RpcClient("http://localhost:11311/").call("getPid", "/me")     # doctest: +SKIP
    [1, '', 4711]
    """

    def __init__(
        self, uri: str, *, timeout_s: float | None = None, answer_limit_bytes: int | None = None
    ) -> None:
        """Store the settings; the first call connects.

        Args:
            uri: `http://HOST:PORT/`.
            timeout_s: total time limit for one call; None for no limit, except on connecting. A call can
                override it.
            answer_limit_bytes: the maximum size of a response. Defaults to `Limits.answer_bytes`, which is
                generous: the user chose the server, so it is trusted.

        Raises:
            ValueError: `uri` is malformed.
        """
        self._idle: list[_ClientConnection] = []
        self.server_addresses: tuple[str, ...] = ()
        self.uri = uri
        self.timeout_s = timeout_s
        self._answer_limit_bytes = answer_limit_bytes or process_limits().answer_bytes
        self._host, self._port, self._path = split_uri(uri)
        self._lock = threading.Lock()
        self._busy: set[_ClientConnection] = set()
        self._interruptions = 0
        self._is_closed = False

    def call(
        self,
        method: str,
        *params: Any,
        timeout_s: float | None = TIMEOUT_OF_CLIENT,
        meanwhile: Callable[[], None] | None = None,
    ) -> Any:
        """Call `method` and return its value. Blocks until the response arrives or the timeout expires.

        `meanwhile` is called when the request has been sent, and again if the request has to be resent.

        Raises:
            Unreachable: the connection failed or was lost, or no response arrived in time.
            Interrupted: `interrupt` was called.
            Fault: the server returned a fault.
            ProtocolError: the response is not XML-RPC.
            LimitExceeded: the response is larger than the limit.
            TypeError, OverflowError, ValueError: XML-RPC cannot represent a parameter; nothing was sent.
        """
        body = encode_call(method, params)
        with self._lock:  # `interrupt` takes the same lock, so it runs before or after this block
            interruptions = self._interruptions
            if timeout_s == TIMEOUT_OF_CLIENT:
                timeout_s = self.timeout_s
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        response = self._exchange(body, deadline, interruptions, meanwhile)
        if response.status != 200:
            detail = response.body[:200].decode("utf-8", "replace").strip()
            raise ProtocolError(f"{self.uri} responded with {response.status} {response.reason}: {detail}")
        return decode_response(response.body, limit_bytes=self._answer_limit_bytes)

    def close(self) -> None:
        """Close the idle connections. The client can still be used, but no longer keeps connections open."""
        with self._lock:
            self._is_closed = True
            idle, self._idle = self._idle, []
        for connection in idle:
            connection.close()

    def __del__(self) -> None:
        for connection in self._idle:
            connection.close()

    def __enter__(self) -> RpcClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def interrupt(self, limit_s: float, grace_s: float = 0.0) -> None:
        """Make calls in progress raise Interrupted. Later calls have the timeout `limit_s`.

        Before that, wait up to `grace_s` for responses to the calls that are in progress now.
        """
        deadline = time.monotonic() + grace_s
        with self._lock:
            present = set(self._busy)
        while present and time.monotonic() < deadline:
            time.sleep(_GRACE_STEP_S)
            with self._lock:
                present &= self._busy
        with self._lock:
            self.timeout_s = limit_s
            self._interruptions += 1
            for connection in self._busy:
                connection.abort()

    def _exchange(
        self,
        body: bytes,
        deadline: float | None,
        interruptions: int,
        meanwhile: Callable[[], None] | None,
    ) -> Response:
        request = build_request(host_and_port(self._host, self._port), self._path, body)
        try:
            if connection := self._pop_idle():
                with contextlib.suppress(_ClosedBeforeAnswer):
                    return self._use(connection, request, deadline, interruptions, meanwhile)
            connection = _ClientConnection(self._host, self._port, self._answer_limit_bytes)
            return self._use(connection, request, deadline, interruptions, meanwhile)
        except (OSError, HttpError) as error:
            raise self._explain(error) from error

    def _note_address(self, found: str) -> None:
        with self._lock:
            others = [known for known in self.server_addresses if known != found]
            self.server_addresses = (found, *others)[:_KEPT_ADDRESSES]

    def _use(
        self,
        connection: _ClientConnection,
        request: bytes,
        deadline: float | None,
        interruptions: int,
        meanwhile: Callable[[], None] | None,
    ) -> Response:
        """Send a request and return the response. Close the connection if this fails or is interrupted."""
        with self._lock:
            self._busy.add(connection)
            if interruptions != self._interruptions:
                connection.abort()
        try:
            if address := connection.open(deadline):
                self._note_address(address)
            response = connection.exchange(request, deadline, meanwhile)
        except BaseException:
            with self._lock:
                self._busy.discard(connection)
            connection.close()
            if connection.is_aborted:
                raise Interrupted(f"a call to {self.uri} was interrupted") from None
            raise
        with self._lock:
            self._busy.discard(connection)
        self._keep_or_close(connection, response)
        return response

    def _pop_idle(self) -> _ClientConnection | None:
        while True:
            with self._lock:
                if not self._idle:
                    return None
                connection = self._idle.pop()
            if connection.is_fresh():
                return connection
            connection.close()

    def _keep_or_close(self, connection: _ClientConnection, response: Response) -> None:
        with self._lock:
            if response.keep_alive and not self._is_closed and len(self._idle) < KEPT_CONNECTIONS:
                self._idle.append(connection)
                return
        connection.close()

    def _explain(self, error: OSError | HttpError) -> Exception:
        if isinstance(error, LimitExceeded):
            return LimitExceeded(f"the response from {self.uri} is too large: {error}")
        if isinstance(error, HttpError):
            return ProtocolError(f"{self.uri} does not speak XML-RPC: {error}")
        return Unreachable(self.uri, reason_of(error))


def reason_of(error: OSError) -> str:
    """Return the operating system's text for an error, such as `Connection refused`."""
    if isinstance(error, TimeoutError):
        return "no response in time"
    if error.errno and not isinstance(error, socket.gaierror):
        return os.strerror(error.errno)  # because asyncio replaces `strerror` with its own text
    return error.strerror or str(error) or type(error).__name__


class _ClosedBeforeAnswer(ConnectionError):
    """The server closed the connection before it sent the first byte of a response."""


class _ClientConnection:
    """One connection, which is kept open. Used by one thread at a time."""

    __slots__ = ("_address", "_connector", "_is_open", "_reader", "_receiver", "_socket")

    def __init__(self, host: str, port: int, answer_limit_bytes: int) -> None:
        """Store the settings; `open` connects."""
        self._address = host, port
        self._connector = Connector()
        self._is_open = False
        self._socket: socket.socket
        self._reader = ResponseReader(body_limit=answer_limit_bytes)
        self._receiver = PollingReceiver(REPLY_POLL_S)

    @property
    def is_aborted(self) -> bool:
        return self._connector.is_interrupted

    def open(self, deadline: float | None) -> str:
        """Connect if not connected. Return the server's IP address if the connection is new."""
        if self._is_open:
            return ""
        host, port = self._address
        limit_s = CONNECT_LIMIT_S if deadline is None else None
        self._socket = self._connector.connect(host, port, deadline, limit_s)
        sockets.keep_from_children(self._socket)
        self._is_open = True
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if self.is_aborted:  # `abort` may have run before the socket was open
            raise Interrupted("the call was interrupted")
        with contextlib.suppress(OSError):  # the server has already closed the connection
            return plain_address(str(self._socket.getpeername()[0]))
        return ""

    def abort(self) -> None:
        """Wake the thread that is waiting on this connection; its exchange fails."""
        self._connector.interrupt()
        if self._is_open:
            sockets.abort_blocked(self._socket)

    def is_fresh(self) -> bool:
        """Return False if the server has closed the idle connection, or sent unexpected bytes."""
        return sockets.is_idle(self._socket)

    def exchange(
        self, request: bytes, deadline: float | None, meanwhile: Callable[[], None] | None
    ) -> Response:
        reader = self._reader
        has_answer_begun = False
        try:
            self._socket.settimeout(_left(deadline))
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                self._socket.sendall(request)  # a server that refuses a request does not read it whole
            self._socket.settimeout(None)
            if meanwhile is not None:
                meanwhile()
            while True:
                data = self._receiver.receive(self._socket, _READ_BYTES, deadline)
                if not data:
                    return self._last_response(has_answer_begun)
                has_answer_begun = True
                if response := reader.feed(data):
                    return response
        except (ConnectionResetError, ConnectionAbortedError, BrokenPipeError) as error:
            if has_answer_begun:
                raise
            raise _ClosedBeforeAnswer(error.errno, error.strerror) from None

    def _last_response(self, has_answer_begun: bool) -> Response:
        """Return a response whose end the server has marked by closing the connection."""
        if not has_answer_begun:
            raise _ClosedBeforeAnswer("connection closed before the response")
        try:
            response = self._reader.end()
        except HttpError:
            response = None
        if response is None:
            raise ConnectionError("connection closed in the middle of the response")
        return response

    def close(self) -> None:
        if self._is_open:
            with contextlib.suppress(OSError):
                self._socket.close()


def _left(deadline: float | None) -> float | None:
    if deadline is None:
        return None
    left = deadline - time.monotonic()
    if left <= 0:
        raise TimeoutError("no response in time")
    return left
