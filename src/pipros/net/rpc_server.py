"""The XML-RPC server that the master and every node answer with.

It runs on an asyncio loop, with one small protocol object for each connection. What a peer may
cost is bounded on every side: the size and depth of what it sends, the time it takes over a
request, what it does not read of our answers, how many requests it sends ahead, and how many
connections it and all peers together hold. When there are too many connections, the one that has
been idle longest gives way to the new one, so idle ones lock nobody out.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import logging
import socket
from collections import OrderedDict, deque
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Final

from pipros.errors import ProtocolError
from pipros.net.address import LOOPBACK
from pipros.wire.http import CONTINUE, HttpError, Request, RequestReader, build_response
from pipros.wire.xmlrpc import BODY_LIMIT_BYTES, decode_call, encode_fault, encode_response

Method = Callable[..., Any]
"""What stands behind a method's name: takes the decoded parameters, returns the value to encode.

A plain function runs in the loop and must not block; a coroutine function may wait.
"""

caller_address: ContextVar[str] = ContextVar("caller_address", default="")
"""The IP address of the peer whose call is being answered, for methods that guard themselves."""

_log = logging.getLogger("pipros.rpc")

_LARGE_BODY_BYTES: Final = 64 * 1024
"""Bodies from here on are decoded in a thread, so that the loop goes on answering others."""


@dataclass(frozen=True, slots=True)
class RpcLimits:
    """What one server bears.

    Attributes:
        body_bytes: the largest request body.
        request_s: the time from the first byte of a request to its last, and for a peer to read our answer.
        idle_s: how long a connection may stay open without a request.
        connections: how many connections at a time; None is what the process may open, less a reserve.
        connections_per_peer: how many of them from one address.
        requests_ahead: how many requests of one connection wait for an answer before it is read no further.
    """

    body_bytes: int = BODY_LIMIT_BYTES
    request_s: float = 30.0
    idle_s: float = 900.0
    connections: int | None = None
    connections_per_peer: int = 2048
    requests_ahead: int = 16


class RpcServer:
    """Serves a table of methods by XML-RPC. `system.multicall` comes with it.

    A call of an unknown method and a method that raises are answered with a fault, in the words
    that ROS' Python peers use; a call with the wrong number of parameters with `[-1, text, 0]`,
    as the ROS API demands (pass `on_bad_arity` for another value).

    All of it happens on the loop on which `start()` was awaited; the calls of one connection are
    answered in order.
    """

    def __init__(
        self,
        methods: Mapping[str, Method],
        *,
        host: str = LOOPBACK,
        port: int = 0,
        limits: RpcLimits | None = None,
        admits: Callable[[str], bool] | None = None,
        on_bad_arity: Callable[[str, tuple[Any, ...]], Any] | None = None,
    ) -> None:
        """Nothing is opened yet.

        Args:
            methods: the table; nothing outside it can be called.
            host: the address to listen on.
            port: the port; 0 is a free one.
            admits: decides by its IP address whether a peer may connect; by default all may.
            on_bad_arity: what to answer for a method called with the wrong number of parameters.
        """
        self._methods = {name: (method, *_arity(method)) for name, method in methods.items()}
        self._methods["system.multicall"] = (self._multicall, 1, 1)
        self._host = host
        self._port = port
        self.limits = limits or RpcLimits()
        self._limit_connections = self.limits.connections or _connections_that_fit()
        self._admits = admits
        self._on_bad_arity = on_bad_arity or _bad_arity
        self._server: asyncio.Server | None = None
        self._sweeper: asyncio.TimerHandle | None = None
        self._connections: OrderedDict[_Connection, None] = OrderedDict()
        self._by_peer: dict[str, OrderedDict[_Connection, None]] = {}
        self._deadlines: OrderedDict[_Connection, float] = OrderedDict()
        self._refused: dict[str, int] = {}
        self.calls = 0
        self.connections_refused = 0
        self.connections_closed_for_room = 0
        self.requests_refused = 0

    @property
    def port(self) -> int:
        """The port it listens on; valid from `start()` on."""
        return self._port

    @property
    def connection_count(self) -> int:
        return len(self._connections)

    async def start(self) -> None:
        """Opens the port. Connections are accepted when it returns.

        Raises:
            OSError: when the port is taken or the address is not of this machine.
        """
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: _Connection(self, loop), self._host, self._port, backlog=1024, family=_family(self._host)
        )
        self._port = self._server.sockets[0].getsockname()[1]
        self._sweeper = loop.call_later(1.0, self._sweep, loop)

    async def stop(self) -> None:
        """Closes the port and all connections. Calls in progress are not waited for."""
        if self._sweeper:
            self._sweeper.cancel()
        if self._server:
            self._server.close()
        for connection in list(self._connections):
            connection.abort()
        if self._server:
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._server.wait_closed(), 1.0)

    def call(self, name: str, params: tuple[Any, ...]) -> Any:
        """Calls one method of the table as a peer would; may return an awaitable.

        Raises:
            LookupError: when there is no such method.
        """
        self.calls += 1
        found = self._methods.get(name)
        if found is None:
            raise UnknownMethod(name)
        method, least, most = found
        if not least <= len(params) <= most:
            return self._on_bad_arity(name, params)
        return method(*params)

    async def _multicall(self, calls: Any) -> list[Any]:
        answers: list[Any] = []
        for call in calls:
            try:
                name, params = call["methodName"], call["params"]
                answer = self.call(name, tuple(params))
                answers.append([await answer if inspect.isawaitable(answer) else answer])
            except Exception as error:
                answers.append({"faultCode": 1, "faultString": fault_text(error)})
        return answers

    # ---- bookkeeping of connections, called by them

    def _enter(self, connection: _Connection) -> bool:
        """Takes a new connection in; False when it must be closed."""
        peer = connection.peer
        if self._admits and not self._admits(peer):
            self.connections_refused += 1
            self.note_refusal(peer, "a connection from a network that is not allowed here")
            return False
        of_peer = self._by_peer.setdefault(peer, OrderedDict())
        if len(of_peer) >= self.limits.connections_per_peer:
            self._make_room(of_peer)
        elif len(self._connections) >= self._limit_connections:
            self._make_room(self._connections)
        of_peer[connection] = None
        self._connections[connection] = None
        return True

    def _make_room(self, candidates: OrderedDict[_Connection, None]) -> None:
        connection = next(iter(candidates))
        self.connections_closed_for_room += 1
        self.note_refusal(connection.peer, "more connections than the limit; the one idle longest was closed")
        connection.abort()
        self._leave(connection)

    def _leave(self, connection: _Connection) -> None:
        self._connections.pop(connection, None)
        self._deadlines.pop(connection, None)
        of_peer = self._by_peer.get(connection.peer)
        if of_peer is not None:
            of_peer.pop(connection, None)
            if not of_peer:
                del self._by_peer[connection.peer]

    def _touch(self, connection: _Connection) -> None:
        """The connection was of use just now: it is the last to give way."""
        if connection in self._connections:
            self._connections.move_to_end(connection)
            self._by_peer[connection.peer].move_to_end(connection)

    def note_refusal(self, peer: str, text: str) -> None:
        """Counts a refusal; writes it to the log once a peer."""
        count = self._refused.get(peer, 0)
        if count or len(self._refused) < 10_000:
            self._refused[peer] = count + 1
        if not count:
            _log.warning("refused %s: %s (counted from now on, not logged)", peer, text)

    @property
    def refusals(self) -> dict[str, int]:
        """How often each peer was refused something."""
        return dict(self._refused)

    def _sweep(self, loop: asyncio.AbstractEventLoop) -> None:
        now = loop.time()
        while self._deadlines:
            connection, deadline = next(iter(self._deadlines.items()))
            if deadline > now:
                break
            connection.give_up()
        idle_since = now - self.limits.idle_s
        while self._connections and (oldest := next(iter(self._connections))).last_used < idle_since:
            oldest.abort()
            self._leave(oldest)
        self._sweeper = loop.call_later(1.0, self._sweep, loop)


class UnknownMethod(LookupError):
    """A call of a method that is not in the table."""


def fault_text(error: BaseException) -> str:
    """An exception in the words of Python's XML-RPC server, which scripts compare."""
    if isinstance(error, UnknownMethod):
        return f'{Exception}:method "{error}" is not supported'
    return f"{type(error)}:{error}"


def _bad_arity(_name: str, _params: tuple[Any, ...]) -> list[Any]:
    return [-1, "Error: bad call arity", 0]


def _arity(method: Method) -> tuple[int, int]:
    """The least and the largest number of positional parameters that `method` takes."""
    least = most = 0
    for parameter in inspect.signature(method).parameters.values():
        if parameter.kind is parameter.VAR_POSITIONAL:
            return least, 1_000_000
        if parameter.kind in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            most += 1
            least += parameter.default is parameter.empty
    return least, most


def _family(host: str) -> int:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def _connections_that_fit() -> int:
    """How many connections the process can hold, with a reserve for everything else it opens."""
    try:
        import resource
    except ImportError:  # Windows, where sockets do not count as files
        return 4096
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY:
        return 16384
    return max(64, min(16384, soft - max(128, soft // 4)))


class _Connection(asyncio.Protocol):
    """One connection. Requests are answered one after the other, in the order they came."""

    def __init__(self, server: RpcServer, loop: asyncio.AbstractEventLoop) -> None:
        self._server = server
        self._loop = loop
        self._reader = RequestReader(body_limit=server.limits.body_bytes)
        self._transport: asyncio.Transport | None = None
        self._waiting: deque[Request] = deque()
        self._task: asyncio.Task[None] | None = None
        self._is_closing = False
        self._is_stalled = False
        self._is_reading = True
        self.peer = ""
        self.last_used = loop.time()

    # ---- called by asyncio

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  # a TCP server makes no others
        self._transport = transport
        address = transport.get_extra_info("peername")
        self.peer = address[0] if address else ""
        if not self._server._enter(self):
            transport.abort()

    def connection_lost(self, _error: Exception | None) -> None:
        self._transport = None
        self._waiting.clear()
        self._server._leave(self)

    def data_received(self, data: bytes) -> None:
        if self._is_closing:
            return
        try:
            requests = self._reader.feed(data)
        except HttpError as error:
            self._refuse(error)
            return
        if requests:
            self.last_used = self._loop.time()
            self._server._touch(self)
            for request in requests:
                if self._task or self._waiting:
                    self._waiting.append(request)
                else:
                    self._answer(request)
            if len(self._waiting) > self._server.limits.requests_ahead:
                self._hold_reading()
        elif self._reader.wants_continue() and self._transport:
            self._transport.write(CONTINUE)
        self._update_deadline()

    def eof_received(self) -> bool:
        # Whoever is half closed may still want the answers to what it has sent.
        self._is_closing = True
        return bool(self._task or self._waiting)

    def pause_writing(self) -> None:
        self._is_stalled = True
        self._hold_reading()
        self._update_deadline()

    def resume_writing(self) -> None:
        self._is_stalled = False
        self._go_on_reading()
        self._update_deadline()

    # ---- called by the server

    def abort(self) -> None:
        """Closes at once; what was not sent is lost."""
        self._is_closing = True
        self._waiting.clear()
        if self._task:
            self._task.cancel()
        if self._transport:
            self._transport.abort()

    def give_up(self) -> None:
        """The peer took too long over a request or over reading the answer."""
        self._server.requests_refused += 1
        self._server.note_refusal(self.peer, f"too slow: more than {self._server.limits.request_s:g} s")
        self.abort()
        self._server._leave(self)

    # ---- deadlines and back pressure

    def _update_deadline(self) -> None:
        """Runs while a request is incomplete or our answer is not read; single bytes do not extend it."""
        deadlines = self._server._deadlines
        if self._is_closing or not (self._is_stalled or not self._reader.is_idle):
            deadlines.pop(self, None)
        elif self not in deadlines:
            deadlines[self] = self._loop.time() + self._server.limits.request_s

    def _hold_reading(self) -> None:
        if self._is_reading and self._transport:
            self._is_reading = False
            self._transport.pause_reading()

    def _go_on_reading(self) -> None:
        if (
            not self._is_reading
            and not self._is_stalled
            and self._transport
            and not self._transport.is_closing()
        ):
            self._is_reading = True
            self._transport.resume_reading()

    # ---- answering

    def _answer(self, request: Request) -> None:
        """Answers at once when the method is quick; else a task does, and the requests behind it wait."""
        if len(request.body) >= _LARGE_BODY_BYTES:
            self._start_task(request, self._decode_apart(request.body))
            return
        caller = caller_address.set(self.peer)
        try:
            name, params = decode_call(request.body)
            value = self._server.call(name, params)
            if inspect.isawaitable(value):
                self._start_task(request, value)
                return
            document = encode_response(value)
        except Exception as error:
            document = self._fault(error)
        finally:
            caller_address.reset(caller)
        self._send(request, document)

    async def _decode_apart(self, body: bytes) -> Any:
        name, params = await asyncio.to_thread(decode_call, body, limit_bytes=self._server.limits.body_bytes)
        value = self._server.call(name, params)
        return await value if inspect.isawaitable(value) else value

    def _start_task(self, request: Request, value: Any) -> None:
        self._task = self._loop.create_task(self._answer_later(request, value))

    async def _answer_later(self, request: Request, value: Any) -> None:
        try:
            document = encode_response(await value)
        except Exception as error:
            document = self._fault(error)
        self._task = None
        self._send(request, document)
        while self._waiting and not self._task and self._transport:
            self._answer(self._waiting.popleft())
        if len(self._waiting) <= self._server.limits.requests_ahead // 2:
            self._go_on_reading()
        if self._is_closing and not self._task and self._transport:
            self._transport.close()

    def _fault(self, error: Exception) -> bytes:
        if isinstance(error, ProtocolError):
            self._server.requests_refused += 1
            self._server.note_refusal(self.peer, str(error))
        elif not isinstance(error, UnknownMethod):
            _log.debug("a method raised for %s", self.peer, exc_info=error)
        return encode_fault(1, fault_text(error))

    def _send(self, request: Request, document: bytes) -> None:
        if self._transport is None or self._transport.is_closing():
            return
        is_old = not request.keep_alive or "connection" in request.headers
        self._transport.write(build_response(document, keep_alive=request.keep_alive, http_1_0=is_old))
        if not request.keep_alive:
            self._close_softly()

    def _refuse(self, error: HttpError) -> None:
        self._server.requests_refused += 1
        self._server.note_refusal(self.peer, str(error))
        if self._transport:
            body = f"{error}\n".encode("utf-8", "replace")
            self._transport.write(build_response(body, status=error.status, keep_alive=False))
            self._close_softly()

    def _close_softly(self) -> None:
        self._is_closing = True
        self._waiting.clear()
        self._server._deadlines.pop(self, None)
        if self._transport:
            self._transport.close()
