"""A ROS node as an explicit object. `rospy` is a facade that holds one; a process may have several."""

from __future__ import annotations

import asyncio
import concurrent.futures
import functools
import inspect
import logging
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from threading import get_ident
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from pipros.env import Environment
from pipros.errors import Interrupted, Unreachable
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.master import MasterClient
from pipros.net.rpc_server import RpcServer
from pipros.net.tcpros import TcprosServer
from pipros.node import aio
from pipros.node.client import OpenCalls, ServiceClient
from pipros.node.clock import Clock, SimulatedClock, WallClock
from pipros.node.identity import Identity
from pipros.node.params import Parameters
from pipros.node.publisher import Publisher
from pipros.node.registration import Registrations
from pipros.node.service import ServiceClass, ServiceServer
from pipros.node.slave import on_bad_arity, slave_methods
from pipros.node.stream import MessageStream
from pipros.node.subscriber import NO_ARGS, Subscriber
from pipros.node.topics import Topics
from pipros.node.traffic import WindowLimits
from pipros.node.waiting import wait_in_slices

if TYPE_CHECKING:
    from pipros.msg.base import Message

AnyMessage = TypeVar("AnyMessage", bound="Message")

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
        rpc_port: int = 0,
        tcpros_port: int = 0,
    ) -> None:
        """Nothing is connected until `start`.

        Args:
            name: the base name; `__name:=` in `argv` wins over it.
            anonymous: make the name unique.
            argv: command-line arguments; the remappings among them apply.
            environment: by default that of the process.
            log: by default a logger of the node's own.
            on_shutdown_request: called with the reason when a peer asks the node to end.
            rpc_port: the port of the slave API; 0 takes a free one.
            tcpros_port: the port for topics and services; 0 takes a free one.

        Raises:
            InvalidName: a name with a namespace in it.
        """
        self.identity = Identity.settle(
            name, anonymous=anonymous, argv=argv, environment=environment or Environment.from_os()
        )
        self.name = self.identity.name
        self.namespace = self.identity.namespace
        self.environment = self.identity.environment
        self.resolve = self.identity.resolve
        self.host = address.advertised_host(self.environment)
        self.log = log or logging.Logger(self.name, logging.WARNING)
        self.master = MasterClient(self.environment.master_uri, self.name)
        self.params = Parameters(self.master, self.resolve, lambda: self._registrations)
        self.clock: Clock = WallClock()
        self.topics: Topics
        self.uri = ""
        self._on_shutdown_request = on_shutdown_request or self.shutdown
        self._ports = rpc_port, tcpros_port
        self._calls = OpenCalls()
        self._loop = BackgroundLoop(f"node {self.name}")
        self._registrations: Registrations | None = None
        self._lock = threading.Lock()
        self._ending_thread: int | None = None
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
        self._rpc = RpcServer(
            slave_methods(self, self.environment.master_uri),
            host=host,
            port=self._ports[0],
            on_bad_arity=on_bad_arity,
        )
        await self._rpc.start()
        self._tcpros = TcprosServer(
            host, self._ports[1], on_connection=lambda connection: self.topics.attach(connection)
        )
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
        self._tcpros.start()

    async def _close(self) -> None:
        self._tcpros.stop()
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
        while not self.is_shutdown:
            try:
                self.master.get_pid()
                return
            except Unreachable as error:
                if on_missing is not None and not is_told:
                    is_told = True
                    on_missing(error)
            self.clock.sleep(MASTER_RETRY_S)
        raise Interrupted(f"{self.name} was shut down while it waited for the master")

    def use_simulated_time(self) -> SimulatedClock:
        """Makes the node's clock follow `/clock`; waits on the wall clock end."""
        from pipros.msg import load_message_class
        from pipros.msg.time import Time

        clock, wall = SimulatedClock(self._explain_silence), self.clock

        def on_clock(message: Any) -> None:
            now: Time = message.clock
            clock.set_ns(now.to_nsec())

        self.clock = clock
        wall.interrupt()
        self.subscribe("/clock", load_message_class("rosgraph_msgs/Clock"), on_clock, queue_size=1)
        return clock

    def _explain_silence(self) -> None:
        self.log.warning(
            "waiting for simulated time: /use_sim_time is true, but nobody publishes on /clock. "
            "Start the simulator or `rosbag play --clock`, or set /use_sim_time to false"
        )

    def watch_descriptor(self, descriptor: socket.socket, on_readable: Callable[[], object]) -> None:
        """Has `on_readable` called in the node's event loop whenever the socket can be read."""
        self._loop.call(self._loop.asyncio.add_reader, descriptor, on_readable)

    def enable_statistics(self, limits: WindowLimits | None = None) -> None:
        """Publishes on `/statistics` what the subscriptions measure."""
        from pipros.node.statistics import StatisticsPublisher

        self.topics.observe(
            StatisticsPublisher(
                self.name, self.advertise, lambda: self.clock.now_ns(), limits or WindowLimits()
            ).arrived
        )

    @property
    def is_shutdown(self) -> bool:
        """True from the moment the end began; only the hooks still see False, and may still publish."""
        return self._ended.is_set() or (self._ending_thread or get_ident()) != get_ident()

    @property
    def is_ending(self) -> bool:
        """True from the moment the end began, for hooks too."""
        return self._ending_thread is not None

    def wait_for_shutdown(self, timeout_s: float | None = None) -> bool:
        """Waits until the node has been shut down; False when the time is over first."""
        return wait_in_slices(self._ended.wait, timeout_s)

    def at_end(self, hook: Callable[[], object]) -> None:
        """Has `hook` called when the node ends, while it can still publish; the earliest one first."""
        self._at_end.append(hook)

    def end_soon(self, reason: str) -> None:
        """Has the node shut down by a thread of its own, for callers that must not wait."""
        end = self._on_shutdown_request
        threading.Thread(target=end, args=(reason,), name=f"end {self.name}", daemon=True).start()

    def shutdown(self, reason: str = "") -> None:
        """Ends the node: hooks, then the entries at the master, then all links. Returns when it is done.

        From the first moment on, only the hooks may publish: what they say last (a robot's "stop")
        is not followed by what another thread was about to say. An exception in a hook is logged.
        Harmless when repeated; a second caller waits for the first.
        """
        with self._lock:
            is_first, self._ending_thread = self._ending_thread is None, self._ending_thread or get_ident()
        if not is_first:
            if self._ending_thread != get_ident():  # a hook that asks for the end is in the middle of it
                wait_in_slices(self._ended.wait)
            return
        self.log.debug("signal_shutdown [%s]", reason)
        is_started = self._registrations is not None
        if is_started:
            self.topics.reserve_publishing(get_ident())
        self.clock.interrupt(exempt=get_ident())
        for hook in list(self._at_end):
            try:
                hook()
            except Exception:
                self.log.exception("a shutdown hook of %s failed", self.name)
        try:
            if is_started:
                self._leave()
        finally:
            self.clock.interrupt()
            self._ended.set()

    def _leave(self) -> None:
        self._calls.interrupt()
        self.registrations.close()
        self.topics.close()
        try:
            self._loop.run(self._close(), SHUTDOWN_DEADLINE_S)
        except (TimeoutError, asyncio.TimeoutError, concurrent.futures.TimeoutError):
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

    async def __aenter__(self) -> Node:
        await asyncio.get_running_loop().run_in_executor(None, self.start)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        end = functools.partial(self.shutdown, "the end of a with statement")
        await asyncio.get_running_loop().run_in_executor(None, end)

    # -- topics and services ------------------------------------------------------

    def advertise(
        self,
        topic: str,
        message_class: type[AnyMessage],
        *,
        queue_size: int | None = 10,
        latch: bool = False,
    ) -> Publisher[AnyMessage]:
        """Publishes on a topic; see `pipros.net.outgoing` for what `queue_size` means.

        A latched topic gives its newest message to every subscriber that comes later.
        """
        return self.topics.advertise(self.resolve(topic), message_class, queue_size=queue_size, latch=latch)

    def subscribe(
        self,
        topic: str,
        message_class: type[AnyMessage],
        callback: Callable[[AnyMessage], object] | Callable[[AnyMessage, Any], object] | None = None,
        *,
        callback_args: object = NO_ARGS,
        queue_size: int | None = None,
        tcp_nodelay: bool = True,
    ) -> Subscriber[AnyMessage]:
        """Has `callback` called with each message of a topic, in a thread of the link it came over.

        With `queue_size` n, a slow callback gets the n newest messages and misses older ones.
        In an asyncio loop and without a callback, the subscriber is an asynchronous iterator:

        >>> async for message in node.subscribe("/chatter", String):            # doctest: +SKIP
        ...     print(message.data)
        """
        if callback is None and aio.is_in_event_loop():
            callback = MessageStream[Any](queue_size)
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
        handler: Callable[[Any], Any],
        on_error: Callable[[BaseException], object] | None = None,
    ) -> ServiceServer:
        """Answers a service; see `ServiceServer`. A coroutine function runs in the caller's asyncio loop."""
        if inspect.iscoroutinefunction(handler):
            handler = aio.run_in_loop(handler, asyncio.get_running_loop())
        return self.topics.serve(self.resolve(service), service_class, handler, on_error)

    def client(
        self,
        service: str,
        service_class: ServiceClass,
        *,
        persistent: bool = False,
        headers: Mapping[str, str] | None = None,
    ) -> ServiceClient:
        """What calls a service; see `ServiceClient`. Its calls end with the node."""
        return ServiceClient(
            self.resolve(service),
            service_class,
            master=lambda: self.master,
            calls=self._calls,
            persistent=persistent,
            headers=headers,
        )

    async def call(
        self, service: str, service_class: ServiceClass, request: Message, timeout_s: float | None = None
    ) -> Any:
        """Calls a service from a coroutine; cancelling it ends the call. Raises as `ServiceClient.call`."""
        return await aio.call(self.client(service, service_class), request, timeout_s)

    def statistics(self) -> Mapping[str, Any]:
        """What the node did so far; see `Topics.statistics`."""
        return self.topics.statistics()
