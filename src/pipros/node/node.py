"""A ROS node as an explicit object. `rospy` is a facade that holds one; a process may have several."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import TracebackType
from typing import TYPE_CHECKING, Any

from pipros import names
from pipros.env import Environment, split_master_uri
from pipros.errors import Interrupted, InvalidName, Unreachable
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.master import MasterClient
from pipros.net.rpc_server import RpcServer
from pipros.net.tcpros import TcprosServer
from pipros.node.clock import Clock, SimulatedClock, WallClock
from pipros.node.params import Parameters
from pipros.node.publisher import Publisher
from pipros.node.registration import Registrations
from pipros.node.service import ServiceClass, ServiceServer
from pipros.node.slave import on_bad_arity, slave_methods
from pipros.node.subscriber import NO_ARGS, Callback, Subscriber
from pipros.node.topics import Topics

if TYPE_CHECKING:
    from pipros.msg.base import Message

#: How often a node that found no master tries again.
MASTER_RETRY_S = 0.2
#: How long the end of a node may wait for its event loop to close everything.
SHUTDOWN_DEADLINE_S = 2.0


class Node:
    """A node: its names, its place in the graph, and all that it publishes, subscribes and serves.

    Use it as a context manager, or call `start` and `shutdown`. Every method may be called from
    any thread. Nothing here touches signals or other state of the process.

    >>> with Node("listener") as node:                                     # doctest: +SKIP
    ...     node.subscribe("/chatter", String, lambda message: print(message.data))
    ...     node.wait_for_shutdown()
    """

    def __init__(
        self,
        name: str,
        *,
        anonymous: bool = False,
        argv: Sequence[str] = (),
        environment: Environment | None = None,
        log: logging.Logger | None = None,
        on_shutdown_request: Callable[[str], object] | None = None,
    ) -> None:
        """Nothing is connected until `start`.

        Args:
            name: the base name; `__name:=` in `argv` wins over it.
            anonymous: make the name unique.
            argv: command-line arguments; the remappings among them apply.
            environment: by default that of the process.
            log: by default a logger of the node's own.
            on_shutdown_request: called with the reason when a peer asks the node to end.

        Raises:
            InvalidName: a name with a namespace in it.
        """
        arguments = names.parse_arguments(argv)
        environment = environment or Environment.from_os()
        self.environment = replace(
            environment,
            master_uri=arguments.special.get("__master", environment.master_uri),
            hostname=arguments.special.get("__hostname", environment.hostname),
            ip=arguments.special.get("__ip", environment.ip),
        )
        if "__name" in arguments.special:
            name = arguments.special["__name"]
        elif anonymous:
            name = names.anonymous(name)
        if not name or "/" in name:
            raise InvalidName(f"[{name}] is no node name: it must be a name without a namespace")
        ns = arguments.special.get("__ns", self.environment.namespace)
        self.namespace = names.make_global_namespace(ns)
        self.name = names.resolve(name, names.join(self.namespace, "x"))
        self.arguments = arguments
        self.remappings = names.resolve_remappings(arguments.remappings, self.name)
        self.host = address.advertised_host(self.environment)
        self.log = log or logging.Logger(self.name, logging.WARNING)
        self.master = MasterClient(self.environment.master_uri, self.name)
        self.params = Parameters(self.master, self.resolve, lambda: self._registrations)
        self.clock: Clock = WallClock()
        self.topics: Topics
        self.uri = ""
        self.refused_requests = 0
        self._on_shutdown_request = on_shutdown_request or self.shutdown
        self._loop = BackgroundLoop(f"node {self.name}")
        self._registrations: Registrations | None = None
        self._master_addresses: set[object] = set()
        self._ending = threading.Lock()
        self._ended = threading.Event()
        self._at_end: list[Callable[[], object]] = []

    # -- life -----------------------------------------------------------------

    def start(self) -> None:
        """Opens the node's ports. The master hears of the node with its first entry.

        Raises:
            OSError: the address that the environment names is not of this machine.
        """
        host = address.bind_host(self.environment)
        self._loop.start()
        try:
            self._loop.run(self._open(host))
        except BaseException:
            self._loop.stop()
            raise
        self._loop.spawn(self.registrations.watch())

    async def _open(self, host: str) -> None:
        self._rpc = RpcServer(slave_methods(self), host=host, on_bad_arity=on_bad_arity)
        await self._rpc.start()
        self._tcpros = TcprosServer(host, lambda connection: self.topics.attach(connection))
        self.uri = address.uri(self.host, self._rpc.port)
        self._registrations = Registrations(self.master, self.name, self.uri, self.log)
        self.topics = Topics(
            self.name,
            host=self.host,
            port=self._tcpros.port,
            loop=self._loop,
            registrations=self._registrations,
            log=self.log,
        )
        await self._tcpros.start()

    async def _close(self) -> None:
        await self._tcpros.stop()
        await self._rpc.stop()

    @property
    def registrations(self) -> Registrations:
        if self._registrations is None:
            raise RuntimeError(f"{self.name} was not started")
        return self._registrations

    def wait_for_master(self, on_missing: Callable[[Unreachable], object] | None = None) -> None:
        """Waits until the master answers; `on_missing` is told once when it does not.

        Raises:
            Interrupted: the node was shut down meanwhile.
        """
        is_told = False
        while not self._ended.is_set():
            try:
                self.master.get_pid()
                return
            except Unreachable as error:
                if on_missing is not None and not is_told:
                    is_told = True
                    on_missing(error)
            self._ended.wait(MASTER_RETRY_S)
        raise Interrupted(f"{self.name} was shut down while it waited for the master")

    def use_simulated_time(self) -> SimulatedClock:
        """Makes the node's clock follow `/clock`; waits on the wall clock end."""
        from pipros.msg import load_message_class
        from pipros.msg.time import Time

        clock, wall = SimulatedClock(), self.clock

        def on_clock(message: Any) -> None:
            now: Time = message.clock
            clock.set_ns(now.to_nsec())

        self.clock = clock
        wall.close()
        self.subscribe("/clock", load_message_class("rosgraph_msgs/Clock"), on_clock, queue_size=1)
        return clock

    @property
    def is_shutdown(self) -> bool:
        return self._ended.is_set()

    def wait_for_shutdown(self, timeout_s: float | None = None) -> bool:
        """Waits until the node has been shut down; False when the time is over first."""
        return self._ended.wait(timeout_s)

    def at_end(self, hook: Callable[[], object]) -> None:
        """Has `hook` called when the node ends, while it can still publish; the earliest one first."""
        self._at_end.append(hook)

    def end_soon(self, reason: str) -> None:
        """Has the node shut down by a thread of its own, for callers that must not wait."""
        end = self._on_shutdown_request
        threading.Thread(target=end, args=(reason,), name=f"end {self.name}", daemon=True).start()

    def shutdown(self, reason: str = "") -> None:
        """Ends the node: hooks, then the entries at the master, then all links. Returns when it is done.

        Harmless when repeated; a second caller returns at once. An exception in a hook is logged.
        """
        if not self._ending.acquire(blocking=False):
            return
        self.log.debug("signal_shutdown [%s]", reason)
        for hook in list(self._at_end):
            try:
                hook()
            except Exception:
                self.log.exception("a shutdown hook of %s failed", self.name)
        self._ended.set()
        self.clock.close()
        if self._registrations is None:
            return
        self._registrations.close()
        self.topics.close()
        try:
            self._loop.run(self._close(), SHUTDOWN_DEADLINE_S)
        except (TimeoutError, asyncio.TimeoutError):
            self.log.debug("%s did not close its ports in time", self.name)
        self._loop.stop()
        self.master.close()

    def __enter__(self) -> Node:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.shutdown("the end of a with statement")

    def is_address_of_master(self, host: str) -> bool:
        """True for an IP address that the master's URI leads to."""
        if not self._master_addresses:
            master_host, _ = split_master_uri(self.environment.master_uri)
            with contextlib.suppress(OSError):
                self._master_addresses = {info[4][0] for info in socket.getaddrinfo(master_host, None)}
        return host in self._master_addresses

    # -- names ------------------------------------------------------------------

    def resolve(self, name: str) -> str:
        """The global name that `name` means in this node, remappings applied."""
        return names.resolve(name, self.name, self.remappings)

    # -- topics and services ------------------------------------------------------

    def advertise(
        self,
        topic: str,
        message_class: type[Message],
        *,
        queue_size: int | None = 10,
        latch: bool = False,
    ) -> Publisher:
        """Publishes on a topic; see `pipros.net.outgoing` for what `queue_size` means.

        A latched topic gives its newest message to every subscriber that comes later.
        """
        return self.topics.advertise(self.resolve(topic), message_class, queue_size=queue_size, latch=latch)

    def subscribe(
        self,
        topic: str,
        message_class: type[Message],
        callback: Callback | None = None,
        *,
        callback_args: object = NO_ARGS,
        queue_size: int | None = None,
        tcp_nodelay: bool = True,
    ) -> Subscriber:
        """Has `callback` called with each message of a topic, in a thread of the link it came over.

        With `queue_size` n, a slow callback gets the n newest messages and misses older ones.
        """
        return self.topics.subscribe(
            self.resolve(topic),
            message_class,
            callback,
            callback_args=callback_args,
            queue_size=queue_size,
            tcp_nodelay=tcp_nodelay,
        )

    def serve(
        self,
        service: str,
        service_class: ServiceClass,
        handler: Callable[[Any], Message],
        on_error: Callable[[BaseException], object] | None = None,
    ) -> ServiceServer:
        """Answers a service; see `ServiceServer`."""
        return self.topics.serve(self.resolve(service), service_class, handler, on_error)

    def statistics(self) -> Mapping[str, Any]:
        """What the node did so far; see `Topics.statistics`."""
        return self.topics.statistics()
