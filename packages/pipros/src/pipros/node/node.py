"""A ROS node as an explicit object.

`rospy` is a facade that wraps a Node; a process can have several nodes.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
import weakref
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from threading import get_ident
from types import TracebackType
from typing import TYPE_CHECKING, Any

from pipros.basics import names, one_thread
from pipros.basics.env import Environment
from pipros.basics.errors import Interrupted, Unreachable
from pipros.basics.interruptible_wait import OnceEvent
from pipros.basics.limits import Limits, process_limits
from pipros.basics.ports import PortRange
from pipros.basics.posix import hold_while_forking
from pipros.net import address
from pipros.net.local_stream import shares_memory
from pipros.net.lookup import LOOKUPS, Lookups
from pipros.net.loop import BackgroundLoop, in_daemon_thread
from pipros.net.master_client import MasterClient
from pipros.net.sockets import close_in_children
from pipros.node.clock import Clock, SimulatedClock, WallClock
from pipros.node.identity import Identity
from pipros.node.missing_master import ANSWER_LIMIT_S, MasterWait
from pipros.node.open_calls import OpenCalls
from pipros.node.params import Parameters
from pipros.node.registration import Registrations
from pipros.node.running import RunningNode
from pipros.node.slave import slave_methods
from pipros.node.timings import NODE_TIMINGS, NodeTimings
from pipros.node.topics_and_services import TopicsAndServices

if TYPE_CHECKING:
    from pipros.node.topic_statistics import WindowLimits

STATISTICS_LINKS = 1000
"""Limit: links for which topic statistics are kept. Beyond it, the figures of the link that has been silent
longest are reset.
"""


MASTER_RETRY_S = 0.2
"""Interval at which a node that found no master tries again."""


_LOAD_LINKS_S, _LOAD_NEXT_S = 0.02, 0.005
"""Time after the start at which a node begins to import `_LINK_MODULES`, and the interval between two of
them. Most programs create their topics before, so neither `init_node` nor these links wait for modules that
they do not need, and their first messages come after; whatever comes between waits for one module at most.
"""

_LINK_MODULES = (
    "pipros.net.outgoing",
    "pipros.net.shared_memory",
    "pipros.node.shared_publication",
    "pipros.net.incoming",
    "pipros.node.publisher_dialer",
    "pipros.node.publisher_connector",
    "pipros.node.subscriber",
    "pipros.net.shared_segment",
)
"""Modules that the first link or the first large message needs, which `import rospy` leaves out. A link that
comes sooner imports its modules itself.
"""

_ANNOUNCED = -1
"""Stands for the thread that ends the node, while callbacks return that wait. No thread has this number."""


_loading = threading.Lock()
hold_while_forking(_loading)  # a child can never import what another thread was importing during the fork


async def _load_links() -> None:
    await asyncio.sleep(_LOAD_LINKS_S)
    for name in _LINK_MODULES:
        await asyncio.sleep(_LOAD_NEXT_S)
        with _loading, suppress(OSError, ImportError):  # without descriptors now, the first link tries again
            if "shared" not in name or shares_memory():
                import_module(name)


class Node(TopicsAndServices):
    """A node: its names, its registrations with the master, and its publications, subscriptions and services.

    Use it as a context manager, or call `start` and `shutdown`. Every method may be called from any thread.
    The class does not change signal handlers.

    Examples:
        >>> with Node("listener") as node:  # doctest: +SKIP
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
        ports: str | None = None,
        limits: Limits | None = None,
        timings: NodeTimings = NODE_TIMINGS,
    ) -> None:
        """Store the settings; `start` opens the ports.

        Args:
            name: the base name; `__name:=` in `argv` takes precedence.
            anonymous: whether to make the name unique.
            argv: command-line arguments, including any remappings.
            environment: defaults to `os.environ`.
            log: defaults to a logger named after the node.
            on_shutdown_request: called with the reason when a peer requests the node's shutdown, or another
                node has taken its name. By default, the node shuts down, in the second case with a warning.
            rpc_port: the port for the slave API; 0 selects a free port.
            tcpros_port: the port for topics and services; 0 selects a free port.
            ports: a range such as `11400-11420`; its first free port is used for both. Cannot be combined
                with `rpc_port` or `tcpros_port`. Defaults to `PIPROS_PORTS`.
            limits: limits on the resources that peers can use; defaults to the process-wide limits.
            timings: delays and deadlines, for tests and special networks.

        Raises:
            InvalidName: the name is empty, consists of slashes only, or includes a namespace.
            InvalidEnvironment: `ports`, `PIPROS_PORTS` or `PIPROS_ADVERTISE` has an invalid value.
            ValueError: `ports` is combined with `rpc_port` or `tcpros_port`.
        """
        if ports and (rpc_port or tcpros_port):
            raise ValueError("ports cannot be combined with rpc_port or tcpros_port")
        self.identity = Identity.from_arguments(
            name, anonymous=anonymous, argv=argv, environment=environment or Environment.from_os()
        )
        self.name = self.identity.name
        self.namespace = self.identity.namespace
        self.environment = self.identity.environment
        self.resolve = self.identity.resolve
        port_range = PortRange.parse(ports, "ports") if ports else self.environment.port_range
        self._ports: tuple[int | PortRange, int | PortRange] | PortRange = rpc_port, tcpros_port
        if port_range and rpc_port == tcpros_port == 0:
            self._ports = port_range
        elif port_range:
            self._ports = rpc_port or port_range, tcpros_port or port_range
        self._advertised = address.advertised_address(self.environment, port_range)
        self.limits = limits or process_limits()
        self._timings = timings
        self.log = log or logging.Logger(self.name, logging.WARNING)
        self.master = MasterClient(self.environment.master_uri, self.name)
        self.params = Parameters(self.master, self.resolve, self._registrations_if_started)
        self.clock: Clock = WallClock()
        self._on_shutdown_request = on_shutdown_request or self._end_by_request
        self.calls = OpenCalls()  # the running service calls, which the shutdown interrupts
        self._loop = BackgroundLoop(f"node {self.name}", Lookups(LOOKUPS))
        self._running: RunningNode | None = None
        self._lock = threading.Lock()
        self._ending_thread: int | None = None
        self._ended = OnceEvent()
        self._shutdown_hooks: list[Callable[[], object]] = []

    # -- lifecycle -----------------------------------------------------------------

    def start(self) -> None:
        """Open the node's ports. The master knows the node only after its first registration.

        Raises:
            OSError: the address in the environment does not belong to this machine, a port is in use, or no
                port in the range is free.
        """
        bind_host = address.bind_host(self.environment)
        self._loop.start()
        try:
            self._loop.run(self._open(bind_host))
        except BaseException:
            self._loop.stop()
            raise
        self._loop.spawn(self.registrations.watch())
        if one_thread.has_threads():
            self._loop.spawn(_load_links())
        myself = weakref.ref(self)
        close_in_children(lambda: node._started.descriptors if (node := myself()) else ())

    async def _open(self, bind_host: str) -> None:
        running = RunningNode(self.name, self.master, self._loop, self.log, self._timings)
        await running.open(
            slave_methods(self, self.environment.master_uri),
            advertised=self._advertised,
            bind_host=bind_host,
            ports=self._ports,
            limits=self.limits,
        )
        self._running = running

    def _registrations_if_started(self) -> Registrations | None:
        return self._running.registrations if self._running is not None else None

    def wait_for_master(self, on_missing: Callable[[Unreachable], object] | None = None) -> None:
        """Wait until the master responds. If the first attempt fails, call `on_missing` once.

        A program that accepts connections at the master's address but does not respond, such as a suspended
        master, fails an attempt after `ANSWER_LIMIT_S`.

        Raises:
            Interrupted: the node was shut down while waiting.
            NoMaster: the process runs pytest, where this wait ends after some seconds.
            Fault, ProtocolError: the server at the master's URI is not a ROS master.
        """
        is_reported = False
        wait = MasterWait()
        while not self.is_shutdown:
            try:
                self.master.get_pid(timeout_s=ANSWER_LIMIT_S)
                return
            except Unreachable as error:
                if on_missing is not None and not is_reported:
                    is_reported = True
                    on_missing(error)
                wait.check(error)
            self.clock.sleep(MASTER_RETRY_S)
        raise Interrupted(f"{self.name} was shut down while it waited for the master")

    def use_simulated_time(self) -> SimulatedClock:
        """Make the node's clock follow `/clock`. All waits on the wall clock end."""
        from pipros.msg import load_message_class
        from pipros.msg.time import Time

        clock = SimulatedClock(self._explain_silence, self._timings.clock_silence_s)

        def on_clock(message: Any) -> None:
            now: Time = message.clock
            clock.set_ns(now.to_nsec())

        self.use_clock(clock)
        kind: Any = load_message_class("rosgraph_msgs/Clock")
        clock.source = self.subscribe("/clock", kind, on_clock, queue_size=1)
        return clock

    def use_clock(self, clock: Clock) -> None:
        """Replace the node's clock, and end all waits on the previous clock."""
        self.clock, before = clock, self.clock
        before.interrupt()

    def _explain_silence(self) -> None:
        self.log.warning(
            "waiting for simulated time: /use_sim_time is true, but no time later than 0 has arrived on "
            "/clock. Start or resume the simulator or `rosbag play --clock`, or set /use_sim_time to false"
        )

    def add_reader(self, descriptor: socket.socket, on_readable: Callable[[], object]) -> None:
        """Call `on_readable` in the node's event loop whenever the socket can be read."""
        self._loop.call(self._loop.asyncio.add_reader, descriptor, on_readable)

    def enable_statistics(self, limits: WindowLimits | None = None) -> None:
        """Publish topic statistics for the node's subscriptions on `/statistics`."""
        from pipros.node.statistics_publisher import StatisticsPublisher
        from pipros.node.topic_statistics import WindowLimits

        self.endpoints.observe(
            StatisticsPublisher(
                self.name,
                self.advertise,
                lambda: self.clock.now_ns(),
                limits or WindowLimits(),
                STATISTICS_LINKS,
            ).arrived
        )

    @property
    def is_shutdown(self) -> bool:
        """Whether the shutdown has begun.

        False for the shutdown hooks, in the thread that runs them, because they can still publish.
        """
        return self._ended.is_set() or (self._ending_thread or get_ident()) != get_ident()

    @property
    def is_ending(self) -> bool:
        """Whether the shutdown has begun. Unlike `is_shutdown`, also True for the shutdown hooks."""
        return self._ending_thread is not None

    def wait_for_shutdown(self, timeout_s: float | None = None) -> bool:
        """Wait until the node has been shut down; return False if the timeout expires first."""
        return self._ended.wait(timeout_s)

    def on_shutdown(self, hook: Callable[[], object]) -> None:
        """Call `hook` when the node shuts down, while it can still publish.

        Hooks are called in the order in which they were added.
        """
        self._shutdown_hooks.append(hook)

    def remove_shutdown_hook(self, hook: Callable[[], object]) -> None:
        """Forget a hook, if it was added."""
        if hook in self._shutdown_hooks:
            self._shutdown_hooks.remove(hook)

    def hand_over_messages(self) -> None:
        """Pass messages from the node's publications to its own subscriptions as objects.

        Applies to topics that are advertised or subscribed to afterwards. See `pipros.node.in_process`.
        """
        self.endpoints.own_uri = self.uri

    def shutdown_async(self, reason: str) -> None:
        """Shut the node down in another thread, for callers that must not block."""
        self.end_soon(self._on_shutdown_request, reason)

    def end_soon(self, end: Callable[[str], object], reason: str) -> None:
        """Call `end`, which shuts the node down, in another thread.

        Without threads, the waits of callbacks end first.
        """
        if not one_thread.has_threads():
            self._ending_thread = self._ending_thread or _ANNOUNCED
            self.clock.interrupt()
        one_thread.start_at_last(end, reason, name=f"end {self.name}")

    def _end_by_request(self, reason: str) -> None:
        if reason.endswith(names.REPLACED):
            self.log.warning("%s shuts down on request: %s", self.name, reason)
        self.shutdown(reason)

    def shutdown(self, reason: str = "") -> None:
        """Shut the node down: run the hooks, unregister from the master, then close all links.

        Blocks until done.

        From the start of the shutdown, only the hooks can publish, so no message from another thread follows
        their last message (such as a command that stops a robot). An exception in a hook is logged. May be
        called repeatedly; a second caller waits for the first.
        """
        with self._lock:
            is_first = self._ending_thread in (None, _ANNOUNCED)
            self._ending_thread = get_ident() if is_first else self._ending_thread
        if not is_first:
            if self._ending_thread != get_ident():  # a hook that calls this method runs inside the shutdown
                self._ended.wait()
            return
        self.log.debug("signal_shutdown [%s]", reason)
        one_thread.while_ending(self._shut_down)

    def _shut_down(self) -> None:
        running = self._running
        if running is not None:
            running.endpoints.restrict_publishing_to(get_ident())
        self.clock.interrupt(exempt=get_ident())
        self._run_hooks()
        try:
            if running is not None:
                self.calls.interrupt(
                    self._timings.call_grace_s
                )  # for calls that began just before the shutdown
                try:
                    running.leave()
                finally:  # a loop that kept running would watch descriptors that other code has closed
                    self._loop.stop()
                    self.master.close()
        finally:
            self.clock.interrupt()
            self._ended.set()

    def _run_hooks(self) -> None:
        # A hook may call services, or wait for a thread that calls one.
        self.calls.interrupt_present(self._timings.call_grace_s)
        for hook in list(self._shutdown_hooks):
            try:
                hook()
            except BaseException:  # even sys.exit in a hook must not leave the node half ended
                self.log.exception("a shutdown hook of %s failed", self.name)

    def __enter__(self) -> Node:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.shutdown("the end of a with statement")

    async def __aenter__(self) -> Node:
        await in_daemon_thread(self.start)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await in_daemon_thread(self.shutdown, "the end of a with statement")
