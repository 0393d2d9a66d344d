"""The rosbridge server for WebSockets, and the parts that it shares with the servers for TCP and UDP."""

from __future__ import annotations

import asyncio
import ssl
import threading
import time
from collections.abc import Callable, Collection, Coroutine, Hashable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final, TypeVar

from pipros.basics.limits import Limits
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Time
from pipros.net.loop import BackgroundLoop
from pipros.net.workers import Workers
from pipros.node import Node
from pipros_bridges.admission import Admission
from pipros_bridges.bridge_server import PING_S, PONG_S, BridgeServer
from pipros_bridges.client import BridgeClient
from pipros_bridges.limits import BridgeLimits
from pipros_bridges.rosbridge.authentication import Authenticator
from pipros_bridges.rosbridge.session import RosbridgeNode, RosbridgeSession, Timing
from pipros_bridges.rosbridge.settings import RosbridgeSettings
from pipros_bridges.rosbridge.text_input import BadInput, json_object
from pipros_server.daemon_pool import DaemonPool
from pipros_server.secret import Secret

CLOSING_S: Final = 0.4
"""Maximum time (s) that clients may delay the shutdown of a server."""
ENDING_S: Final = 0.05
"""Maximum time (s) for the remaining tasks if the clients have used up `CLOSING_S`."""

T = TypeVar("T")


class RosbridgeHandler:
    """The rosbridge protocol, as a handler for a `BridgeServer`.

    Sessions run in threads, because publishing and calls to the master may block.
    """

    def __init__(
        self,
        bridge: RosbridgeNode,
        authenticator: Authenticator | None = None,
        on_change: Callable[[], object] = lambda: None,
    ) -> None:
        """Create a handler. `on_change` is called in the event loop when a client connects or disconnects."""
        self._bridge = bridge
        self._authenticator = authenticator
        self._on_change = on_change
        self._threads = DaemonPool("rosbridge client", bridge.limits.of(BridgeLimits).bridge_clients)

    def open(self, client: BridgeClient) -> WebSocketSession:
        """Start a session for a client."""
        asyncio.get_running_loop().call_soon(self._on_change)
        return WebSocketSession(
            client, self._bridge.connect(client.outbox, client.shares), self._threads, self._on_change
        )

    def is_login(self, first: str | bytes) -> bool:
        """Return whether the first message is a valid `auth` operation."""
        if self._authenticator is None:
            return False
        try:
            operation = json_object(first)
        except BadInput:
            return False
        return operation.get("op") == "auth" and self._authenticator.accepts(operation)


class WebSocketSession:
    """The session of one client of a `BridgeServer`."""

    def __init__(
        self,
        client: BridgeClient,
        session: RosbridgeSession,
        threads: DaemonPool,
        on_change: Callable[[], object],
    ) -> None:
        self._client = client
        self._session = session
        self._threads = threads
        self._on_change = on_change

    async def receive(self, data: str | bytes) -> None:
        """Handle a frame. The next frame is not read before this returns."""
        await self._threads.run(self._session.receive, data)
        if self._session.ended:
            self._client.end(self._session.ended)

    @property
    def worked_s(self) -> float:
        return self._session.worked_s

    def takes(self) -> Mapping[Hashable, str]:
        """Return the topics to which the client subscribes."""
        return {topic: topic for topic in self._session.topics}

    def sends(self) -> Sequence[str]:
        """Return the topics that the client publishes."""
        return self._session.published

    @property
    def is_unused(self) -> bool:
        return self._session.is_unused

    def close(self) -> None:
        """Close the session, in a thread."""
        self._threads.start(self._session.close)
        asyncio.get_running_loop().call_soon(self._on_change)


@dataclass(frozen=True, slots=True)
class ServerOptions:
    """Options of a server.

    Attributes:
        host, port: the address to listen on; port 0 selects a free one.
        certificate, key: PEM files for TLS. If `certificate` is None, TLS is disabled; if only `key` is None,
            the certificate file must contain the key.
        origins: origins of pages that may connect, in addition to pages served from this machine.
        allows_null_origin: whether pages without an origin, such as local files, may connect. Every website
            can open such pages.
        authenticator: checks each client's `auth` operation; None to disable authentication.
        ping_s: interval between pings; None disables them.
        pong_s: maximum time to wait for a pong; None waits forever.
        message_bytes: maximum size of a message from a client; None uses the process-wide limit.
    """

    host: str = "127.0.0.1"
    port: int = 9090
    certificate: str | None = None
    key: str | None = None
    origins: Collection[str] = ()
    allows_null_origin: bool = False
    authenticator: Authenticator | None = None
    ping_s: float | None = PING_S
    pong_s: float | None = PONG_S
    message_bytes: int | None = None
    settings: RosbridgeSettings = field(default_factory=RosbridgeSettings)
    timing: Timing = field(default_factory=Timing)


class BridgeRuntime:
    """A server's event loop, threads and `RosbridgeNode`."""

    def __init__(self, node: Node, options: ServerOptions) -> None:
        self.loop = BackgroundLoop("rosbridge")
        self._node = node
        self._closing = threading.Lock()
        self._is_closed = False
        self.limits: Limits = node.limits
        if options.message_bytes is not None:
            self.limits = self.limits.with_table(
                self.limits.of(BridgeLimits)._replace(bridge_message_bytes=options.message_bytes)
            )
        self._workers = Workers("rosbridge timers")
        self.bridge = RosbridgeNode(node, self.call_later, options.settings, options.timing, self.limits)

    def call_later(self, delay_s: float, function: Callable[[], object]) -> None:
        """Call a function in a thread after a delay. Do nothing once the loop has stopped."""
        self.loop.call(self._schedule, delay_s, function)

    def _schedule(self, delay_s: float, function: Callable[[], object]) -> None:
        self.loop.asyncio.call_later(delay_s, self._workers.run, function)

    def start(self, opening: Coroutine[Any, Any, T], close: Callable[[], object]) -> T:
        """Start the loop, open a server in it and return the result. May be called again after an error.

        When the node shuts down, `close` is called in a thread, so that clients do not delay the shutdown.
        """
        self.loop.start()
        try:
            opened = self.loop.run(opening)
        except BaseException:
            self.loop.stop()
            raise
        self._node.on_shutdown(threading.Thread(target=close, name="end of rosbridge", daemon=True).start)
        return opened

    def close(self, close: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Close a server with the coroutine function `close`, then close its clients' services and the loop.

        A second caller waits until the first has finished.
        """
        with self._closing:
            if self._is_closed:
                return
            self._is_closed = True
            end_s = time.monotonic() + CLOSING_S
            with suppress(TimeoutError):
                self.loop.run(close(), CLOSING_S)
            self.bridge.close()
            self.loop.stop(max(end_s - time.monotonic(), ENDING_S))
            self._workers.close()


class WebSocketServer:
    """A rosbridge server for WebSockets on a node. Methods may be called from any thread."""

    def __init__(self, node: Node, options: ServerOptions) -> None:
        self._options = options
        self._runtime = BridgeRuntime(node, options)
        self.bridge = self._runtime.bridge
        self._clients = ClientTopics(node)
        handler = RosbridgeHandler(self.bridge, options.authenticator, self._report)
        # With authentication, clients that have not logged in may send only little data and must log in soon.
        secret = Secret() if options.authenticator is not None else None
        admission = Admission(
            secret, options.origins, options.allows_null_origin, "websocket_null_origin:=true"
        )
        self.server = BridgeServer({"": handler}, admission, limits=self._runtime.limits)

    def start(self) -> int:
        """Open the port and return its number. May be called again after an error.

        Raises:
            OSError: the port is in use, the address does not belong to this machine, or a TLS file cannot be
                read.
            ssl.SSLError: the certificate cannot be used.
        """
        options = self._options
        opening = self.server.open(
            options.host, options.port, tls=_tls(options), ping_s=options.ping_s, pong_s=options.pong_s
        )
        self._runtime.start(opening, self.close)
        self._clients.report([])
        return self.server.port

    def close(self) -> None:
        """Disconnect the clients and close the port."""
        self._runtime.close(self.server.close)
        self._clients.close()

    def _report(self) -> None:
        self._clients.report([(row.address, row.since) for row in self.server.clients()])


class ClientTopics:
    """The latched topics `client_count` and `connected_clients`."""

    def __init__(self, node: Node) -> None:
        self._count_class: Any = load_message_class("std_msgs/Int32")
        self._list_class: Any = load_message_class("rosbridge_msgs/ConnectedClients")
        self._client_class: Any = load_message_class("rosbridge_msgs/ConnectedClient")
        self._count = node.advertise("client_count", self._count_class, queue_size=10, latch=True)
        self._list = node.advertise("connected_clients", self._list_class, queue_size=10, latch=True)
        self._thread = Workers("connected clients", 1)

    def report(self, clients: Collection[tuple[str, float]]) -> None:
        """Publish the addresses and connection times of all clients, in a thread."""
        self._thread.run(self._publish, list(clients))

    def close(self) -> None:
        """Stop publishing."""
        self._thread.close()

    def _publish(self, clients: Collection[tuple[str, float]]) -> None:
        rows = [
            self._client_class(_host(address), Time(*divmod(int(since * NS_PER_S), NS_PER_S)))
            for address, since in clients
        ]
        self._count.publish(self._count_class(len(rows)))
        self._list.publish(self._list_class(rows))


def _host(address: str) -> str:
    """Return the IP address in `IP:PORT`."""
    return address.rpartition(":")[0].strip("[]")


def _tls(options: ServerOptions) -> ssl.SSLContext | None:
    if options.certificate is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(options.certificate, options.key)
    return context
