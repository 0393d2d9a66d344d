"""The XML-RPC server of the master and of every node.

It runs on an asyncio loop. All resources that a peer can use are limited: the size and depth of its requests,
the time for sending a request and for reading the response, the number of requests handled at a time (one per
connection), and the number of connections, both per peer and in total.
"""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import socket
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextvars import ContextVar
from functools import cached_property
from typing import Any, Final

from pipros.basics.errors import LimitExceeded
from pipros.basics.limits import Limits, process_limits
from pipros.basics.ports import PortRange
from pipros.net.address import LOOPBACK
from pipros.net.connection_table import ConnectionTable
from pipros.net.held_bytes import BODIES_BYTES, HeldBytes
from pipros.net.loop_turns import TURN_S, LoopTurns
from pipros.net.refusals import Refusals
from pipros.net.rpc_connection import LARGE_ANSWER, RpcConnection, UnknownMethod, fault_text
from pipros.net.sockets import connections_that_fit, listen_all
from pipros.net.this_machine import ThisMachineCaller
from pipros.net.timings import to_tick_s
from pipros.wire.xmlrpc import Encoded, ValueTooLarge

IDLE_S = 900.0
"""Limit: the time that an XML-RPC connection may stay open without a request. Beyond it, the connection is
closed.
"""
MULTICALL_ANSWER_BYTES = 16 * 1024 * 1024
"""Limit: all responses to one `system.multicall` together. Beyond it, the remaining calls return a fault."""
RPC_CONNECTIONS_PER_PEER = 4096
"""Limit: xML-RPC connections to one server from one address. Beyond it, like `rpc_connections`, among the
connections from one address.
"""

Method = Callable[..., Any]
"""The implementation of a method. It takes the decoded parameters and returns the value to encode.

A plain function runs in the loop and must not block; a coroutine function may wait.
"""

current_caller: ContextVar[ThisMachineCaller] = ContextVar("current_caller", default=ThisMachineCaller())  # noqa: B039  # frozen
"""The peer of the current call, for methods that check permissions."""


_BACKLOG: Final = 1024
_ACCEPTED_AT_A_TIME: Final = 4


class RpcServer:
    """Serves a table of methods, and `system.multicall`, over XML-RPC.

    If a method is unknown or raises an exception, the response is a fault with the same text as in ROS's
    Python nodes. The response to a call with the wrong number of parameters is `[-1, text, 0]`, as the ROS
    API requires (pass `on_bad_arity` for another response).

    Everything runs on the loop on which `start()` was awaited. Each connection gets its responses in the
    order of its calls.

    Attributes:
        calls: the number of calls to each method in the table.
        refusals: the connections that were refused, by peer.
        connections: the open connections.
        bodies: the bytes of requests that are incomplete or not decoded yet.
    """

    def __init__(
        self,
        methods: Mapping[str, Method],
        *,
        host: str | Sequence[str] = LOOPBACK,
        port: int | PortRange = 0,
        limits: Limits | None = None,
        admits: Callable[[ThisMachineCaller], bool] | None = None,
        on_bad_arity: Callable[[str, tuple[Any, ...]], Any] | None = None,
        on_lost: Callable[[ThisMachineCaller], object] | None = None,
    ) -> None:
        """Store the settings; `start` opens the port.

        Args:
            methods: the method table; other methods cannot be called.
            host: the address to listen on, or several addresses, which get the same port; empty if all
                connections are passed to `adopt`.
            port: the port; 0 selects a free port, and a range selects its first free port.
            limits: defaults to the process-wide limits.
            admits: decides, given the two ends of a connection, whether the peer may connect; by default, all
                peers may.
            on_bad_arity: function that returns the response to a call with the wrong number of parameters.
            on_lost: called in the event loop with the two ends of each connection that has closed.
        """
        self._methods = {name: (method, *_arity(method)) for name, method in methods.items()}
        self._methods["system.multicall"] = (self._multicall, 1, 1)
        self._hosts = [host] if isinstance(host, str) else list(host)
        self._wanted_port = port
        self._port = 0
        self._admits = admits
        self._on_bad_arity = on_bad_arity or _bad_arity
        self.on_lost = on_lost
        self._servers: list[asyncio.Server] = []
        self._openings: set[asyncio.Task[Any]] = set()
        self._overdue_timer: asyncio.TimerHandle | None = None
        self._is_stopped = False
        self.limits = limits or process_limits()
        self.calls = dict.fromkeys(self._methods, 0)
        self.refusals = Refusals()
        self.connections = ConnectionTable(
            limit=self.limits.rpc_connections or connections_that_fit(),
            limit_per_peer=RPC_CONNECTIONS_PER_PEER,
            refusals=self.refusals,
        )
        self.bodies = HeldBytes(limit_bytes=BODIES_BYTES, refusals=self.refusals)

    @cached_property
    def large_values(self) -> Executor:
        """The threads that decode and encode large values, which few nodes need."""
        from concurrent.futures import ThreadPoolExecutor

        return ThreadPoolExecutor(max_workers=2, thread_name_prefix="large values")

    @property
    def port(self) -> int:
        """The port; valid after `start()`."""
        return self._port

    @property
    def descriptors(self) -> list[int]:
        """The descriptors of the listening sockets; empty once they are closed."""
        return [listener.fileno() for server in self._servers for listener in server.sockets]

    async def start(self) -> None:
        """Open the port. The server accepts connections once this method has returned.

        Raises:
            OSError: the port is in use, no port in the range is free, or the address does not belong to this
                machine.
        """
        self._is_stopped = False
        loop = asyncio.get_running_loop()
        self.turns = LoopTurns(loop)
        for listener in listen_all(self._hosts, self._port or self._wanted_port):
            self._port = listener.getsockname()[1]
            server = await loop.create_server(
                lambda: RpcConnection(self, loop), sock=listener, backlog=_ACCEPTED_AT_A_TIME
            )
            self._servers.append(server)
            # asyncio's backlog is also the number of connections that it accepts at a time
            listener.listen(_BACKLOG)
        self._close_overdue(loop)

    def adopt(self, sock: socket.socket, received: bytes) -> None:
        """Serve a connection that another server has accepted, and whose first bytes it has read.

        Called in the event loop, after `start`.
        """
        loop = asyncio.get_running_loop()
        opening = loop.create_task(
            loop.connect_accepted_socket(lambda: RpcConnection(self, loop, received), sock)
        )
        self._openings.add(opening)
        opening.add_done_callback(self._openings.discard)

    async def stop(self) -> None:
        """Close the port and all connections, without waiting for calls in progress."""
        self._is_stopped = True
        if self._overdue_timer:
            self._overdue_timer.cancel()
        servers, self._servers = self._servers, []
        for server in servers:
            for listener in server.sockets:
                asyncio.get_running_loop().remove_reader(listener.fileno())
        if servers:
            # Up to Python 3.11, a connection that is being accepted when its server closes is lost and stays
            # open. Yielding once allows such connections to be accepted first.
            await asyncio.sleep(0)
        if self._openings:
            await asyncio.wait(self._openings, timeout=1.0)
        for server in servers:
            server.close()
        self.connections.close_all()
        if "large_values" in vars(self):
            self.large_values.shutdown(wait=False, cancel_futures=True)
        for server in servers:
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(server.wait_closed(), 1.0)

    def _close_overdue(self, loop: asyncio.AbstractEventLoop) -> None:
        next_s = self.connections.close_overdue(loop.time(), IDLE_S)
        self._overdue_timer = loop.call_later(to_tick_s(next_s), self._close_overdue, loop)

    # ---- called by connections

    def admits(self, caller: ThisMachineCaller) -> bool:
        """Return whether a peer may connect; always False after `stop`. Refusals are counted."""
        if self._is_stopped:
            return False
        if self._admits is None or self._admits(caller):
            return True
        self.refusals.count(caller.host, "its network is not admitted")
        return False

    def call(self, name: str, params: tuple[Any, ...], *, caller: ThisMachineCaller) -> Any:
        """Call a method from the table; return its value, or an awaitable for the value.

        Raises:
            UnknownMethod: the method does not exist.
        """
        found = self._methods.get(name)
        if found is None:
            raise UnknownMethod(name)
        self.calls[name] += 1
        method, least, most = found
        if not least <= len(params) <= most:
            return self._on_bad_arity(name, params)
        before = current_caller.set(caller)
        try:
            value = method(*params)
            if inspect.isawaitable(value):  # the task copies the current context
                return asyncio.ensure_future(value)
            return value
        finally:
            current_caller.reset(before)

    async def _multicall(self, calls: Any) -> list[Any]:
        """Run the calls and encode each response separately.

        A value that two calls return counts twice towards the size limit.
        """
        loop = asyncio.get_running_loop()
        caller = current_caller.get()
        answers: list[Any] = []
        bytes_left = MULTICALL_ANSWER_BYTES
        turn_ends = loop.time() + TURN_S
        calls = calls if type(calls) is list else list(calls)
        calls.reverse()
        while calls:
            # drop the list's reference, so that a large number of objects is freed gradually
            call = calls.pop()
            try:
                answer = self.call(call["methodName"], tuple(call["params"]), caller=caller)
                encoded = await self._encode([await answer if inspect.isawaitable(answer) else answer])
                bytes_left -= len(encoded.text)
                if bytes_left < 0:
                    limit = f"the limit is {MULTICALL_ANSWER_BYTES} bytes"
                    raise LimitExceeded(
                        f"the combined responses to a system.multicall are too large; {limit}"
                    )
                answers.append(encoded)
            except Exception as error:
                answers.append({"faultCode": 1, "faultString": fault_text(error)})
            if loop.time() > turn_ends:  # yield to other connections
                await asyncio.sleep(0)
                turn_ends = loop.time() + TURN_S
        return answers

    async def _encode(self, value: Any) -> Encoded:
        try:
            return Encoded(value, size_limit=LARGE_ANSWER)
        except ValueTooLarge:
            return await asyncio.get_running_loop().run_in_executor(self.large_values, Encoded, value)


def _bad_arity(_name: str, _params: tuple[Any, ...]) -> list[Any]:
    return [-1, "Error: bad call arity", 0]


def _arity(method: Method) -> tuple[int, int]:
    """Return the minimum and maximum number of positional parameters that `method` takes."""
    least = most = 0
    for parameter in inspect.signature(method).parameters.values():
        if parameter.kind is parameter.VAR_POSITIONAL:
            return least, 1_000_000
        if parameter.kind in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            most += 1
            least += parameter.default is parameter.empty
    return least, most
