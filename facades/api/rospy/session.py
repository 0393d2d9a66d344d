"""The default node of the process; rospy's module-level functions use it.

All state of rospy is in the `session` object at the end of this module.
"""

from __future__ import annotations

import atexit
import contextlib
import logging
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Protocol
from weakref import WeakSet

from pipros.basics import names
from pipros.basics.env import Environment
from pipros.basics.errors import Interrupted
from pipros.basics.interruptible_wait import OnceEvent
from pipros.basics.posix import call_in_children
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.node.clock import Clock, SimulatedClock, WallClock
from pipros.node.endpoints import NameInUse
from pipros.node.identity import Identity
from pipros.node.log import ros_logger
from pipros.node.log_outputs import open_console_and_file, open_rosout
from pipros.node.logger_services import serve_loggers
from pipros.node.params import Parameters
from pipros.node.service_client import OpenCalls
from pipros.node.signals import NotInMainThread, Signals
from pipros.node.start_params import is_on, set_private_params, window_limits
from rospy.exceptions import ROSException, ROSInitException, ROSInterruptException

Hook = Callable[..., object]

THREAD_END_S = 5.0
"""How long the shutdown waits for each registered thread."""


class InitInterrupted(ROSInitException, ROSInterruptException):
    """The process was shut down while init_node waited for the master."""


class Closable(Protocol):
    """An object that is closed with its node: a `rospy.Publisher`."""

    def close(self) -> None: ...


class Session:
    """The state of rospy in this process: before `init_node`, with its node, and after the shutdown."""

    def __init__(self) -> None:
        self.logger = ros_logger("rosout")
        self.has_time = False
        self.init_arguments: tuple[Any, ...] | None = None  # of init_node
        self.publishers: WeakSet[Closable] = WeakSet()  # each rospy.Publisher
        self._clock: Clock = WallClock()  # before init_node
        self._waits: set[OnceEvent] = set()
        self._lock = threading.RLock()
        self._signals = Signals(self.end)
        self._has_signals = False
        self._early_clients: tuple[str, MasterClient, Parameters] | None = None
        self._arguments: names.Arguments | None = None  # replace the command-line remappings
        self._log_handlers: list[logging.Handler] = []
        self._process_id = 0  # the process that called init_node
        self._reset_node_state()

    def _reset_node_state(self) -> None:
        self.node: Node | None = None
        self.calls = OpenCalls()
        self._waiting_for_node: list[Callable[[Node], object]] = []
        self._early_services: set[str] = set()
        self.client_hooks: list[Hook] = []
        self.preshutdown_hooks: list[Hook] = []
        self.shutdown_hooks: list[Hook] = []
        self.threads_to_join: list[threading.Thread] = []
        self._is_over = False  # shut down without a node, or set to that
        self._remappings: dict[str, str] | None = None
        self._is_initialized: bool | None = None  # overrides the node's state
        self._node_uri: str | None = None  # overrides the node's
        self.log_file: str | None = None
        self.rosout_handler: logging.Handler | None = None
        self.services: dict[str, Any] = {}  # each rospy.Service by its name

    def wait(self, seconds: float) -> None:
        """Wait in wall time, or until the node ends."""
        if self.node is not None:
            self.node.wait_for_shutdown(seconds)
        else:
            time.sleep(seconds)

    @contextlib.contextmanager
    def ended_by_shutdown(self, wait: OnceEvent) -> Iterator[None]:
        """Set the event if the node ends within the block."""
        self._waits.add(wait)
        try:
            yield
        finally:
            self._waits.discard(wait)

    # -- before and after init_node ---------------------------------------------

    @property
    def identity(self) -> Identity:
        """The names of the node; before init_node those of a process without one."""
        if self.node is not None:
            identity = self.node.identity
        else:
            identity = Identity.unnamed(argv=sys.argv, environment=Environment.from_os())
        if self._arguments is not None:
            identity = replace(identity, arguments=self._arguments)
        return identity if self._remappings is None else replace(identity, remappings=self._remappings)

    @property
    def has_resolved_remappings(self) -> bool:
        return self._remappings is not None

    def read_arguments(self, argv: Sequence[str]) -> None:
        """Use the remappings in `argv` instead of those on the command line."""
        self._arguments = names.parse_arguments(argv)

    def resolve_remappings_for(self, node_name: str) -> None:
        """Resolve the remappings relative to `node_name`, a full name."""
        self._remappings = names.resolve_remappings(self.identity.arguments.remappings, node_name)

    @property
    def name(self) -> str:
        return self.identity.name

    @property
    def namespace(self) -> str:
        return self.identity.namespace

    @property
    def is_initialized(self) -> bool:
        if self._is_initialized is not None:
            return self._is_initialized
        return self.node is not None and self.has_time

    @is_initialized.setter
    def is_initialized(self, value: bool) -> None:
        self._is_initialized = value

    @property
    def is_shutdown(self) -> bool:
        return self._is_over or (self.node is not None and self.node.is_shutdown)

    @is_shutdown.setter
    def is_shutdown(self, value: bool) -> None:
        """Restore the state before `init_node` if set to False after the shutdown."""
        if not value and self.node is not None and self.node.is_shutdown:
            self._forget_node()
        self._is_over = value

    @property
    def is_ending(self) -> bool:
        """Whether the shutdown of the node was requested."""
        return self.is_shutdown or (self.node is not None and self.node.is_ending)

    @is_ending.setter
    def is_ending(self, value: bool) -> None:
        """Ignore the value: packages that set it to False also set `is_shutdown`, which has the effect."""

    @property
    def node_uri(self) -> str | None:
        """The URI of the node's slave API, or the assigned one; None before init_node."""
        if self._node_uri is not None or self.node is None:
            return self._node_uri
        return self.node.uri

    @node_uri.setter
    def node_uri(self, value: str | None) -> None:
        self._node_uri = value

    @property
    def clock(self) -> Clock:
        """The clock of the node; before init_node, that of the process."""
        return self._clock if self.node is None else self.node.clock

    def set_sim_time(self, now_ns: int) -> None:
        """Set the time of the clock, and switch to a simulated one."""
        clock = self.clock
        if not isinstance(clock, SimulatedClock):
            clock = SimulatedClock()
            self._replace_clock(clock)
        clock.set_ns(now_ns)

    def use_wall_clock(self) -> None:
        """Switch to the clock of the machine."""
        if self.clock.is_simulated:
            self._replace_clock(WallClock())

    def _replace_clock(self, clock: Clock) -> None:
        if self.node is None:
            self._clock, before = clock, self._clock
            before.interrupt()
        else:
            self.node.use_clock(clock)

    @property
    def params(self) -> Parameters:
        """The parameters; also available before init_node."""
        return self.node.params if self.node is not None else self._early()[2]

    @property
    def master(self) -> MasterClient:
        """The master; also available before init_node."""
        return self.node.master if self.node is not None else self._early()[1]

    def resolve(self, name: str) -> str:
        return self.identity.resolve(name)

    def resolve_topic(self, name: str) -> str:
        """Return the global name of a topic, remapped also before init_node.

        Raises:
            InvalidName: the name is private, before init_node.
        """
        if self.node is not None:
            return self.identity.resolve(name)
        return self.identity.resolve_topic_without_name(name)

    def when_started(self, action: Callable[[Node], object]) -> None:
        """Call `action` with the node: now, or as soon as it has started."""
        with self._lock:
            if self.node is None:
                self._waiting_for_node.append(action)
                return
        action(self.node)

    def claim_service(self, name: str) -> None:
        """Reserve the name of a service that is created before init_node.

        Raises:
            NameInUse: another service has the name. (If there is a node, it checks this itself.)
        """
        with self._lock:
            if self.node is None:
                if name in self._early_services:
                    raise NameInUse(f"service [{name}] already registered")
                self._early_services.add(name)

    def release_service(self, name: str) -> None:
        """Undo `claim_service`. May be called repeatedly."""
        self._early_services.discard(name)

    def _early(self) -> tuple[str, MasterClient, Parameters]:
        uri = Environment.from_os().master_uri
        if self._early_clients is None or self._early_clients[0] != uri:
            master = MasterClient(uri, self.name)
            self._early_clients = uri, master, Parameters(master, self.resolve, lambda: None)
        return self._early_clients

    # -- the start ----------------------------------------------------------------

    def start(
        self,
        name: str,
        argv: Sequence[str] | None,
        *,
        anonymous: bool,
        log_level: int | None,
        disable_rostime: bool,
        disable_rosout: bool,
        disable_signals: bool,
        rpc_port: int,
        tcpros_port: int,
    ) -> None:
        """Start the node; see `rospy.init_node`."""
        argv = sys.argv if argv is None else argv
        arguments = (name, list(argv), anonymous, log_level, disable_rostime, disable_signals)
        if not name:
            raise ValueError("name must not be empty")
        if "/" in name:
            raise ValueError("namespaces are not allowed in node names")
        with self._lock:
            if self.init_arguments is not None:
                if self.init_arguments == arguments:
                    return
                raise ROSException(
                    "rospy.init_node() has already been called with different arguments: "
                    f"{self.init_arguments}"
                )
            self.init_arguments = arguments
        try:
            self._end_previous_node()
            self._start(arguments, disable_rosout, rpc_port, tcpros_port)
        except BaseException:
            if self.node is None:
                self.init_arguments = None
            raise

    def _end_previous_node(self) -> None:
        """End the previous node, if `rospy.client._init_node_args` was set to None while it ran.

        Raises:
            ROSInitException: shutdown was requested.
        """
        if self.is_shutdown:
            raise ROSInitException(
                "init_node interrupted before it could complete: rospy has been shut down "
                "(rospy.core._shutdown_flag = False lets it start over)"
            )
        if self.node is not None:
            self._forget_node()

    def _forget_node(self) -> None:
        """Restore the state before `init_node`. Objects created for the node stay closed.

        A running node is ended first, unless it belongs to this forked process's parent.
        """
        if os.getpid() == self._process_id:
            self.end("another node takes its place")
        else:
            self._signals, self._has_signals = Signals(self.end), False
        for handler in self._log_handlers:
            self.logger.removeHandler(handler)
            logging.getLogger().removeHandler(handler)
            handler.close()
        self._log_handlers.clear()
        for publisher in self.publishers:
            publisher.close()
        self.publishers.clear()
        self._reset_node_state()

    def _start(
        self, arguments: tuple[Any, ...], disable_rosout: bool, rpc_port: int, tcpros_port: int
    ) -> None:
        name, argv, anonymous, log_level, disable_rostime, disable_signals = arguments
        if not names.is_legal_base(name):
            warnings.warn(
                f"'{name}' is not a legal ROS base name. This may cause problems with other ROS tools.",
                stacklevel=4,
            )
        node = Node(
            name,
            anonymous=anonymous,
            argv=argv,
            log=self.logger,
            on_shutdown_request=self._end_by_request,
            rpc_port=rpc_port,
            tcpros_port=tcpros_port,
        )
        node.on_shutdown(self.calls.interrupt_present)
        node.on_shutdown(self._call_client_hooks)
        self._process_id = os.getpid()
        self._log_handlers += open_console_and_file(node, self.logger, log_level)
        if self._has_signals:  # for a former node
            node.start()
            self.node = node
            self._signals.listen_anew(node)
        elif disable_signals:
            node.start()
            self.node = node
        else:
            self._start_with_signals(node)
        atexit.unregister(self.end)
        atexit.register(self.end, "atexit")
        call_in_children(lambda: atexit.unregister(self.end))  # a child's exit does not end the node
        try:
            node.wait_for_master(lambda _: _warn_no_master(node))
        except Interrupted:
            raise InitInterrupted("init_node interrupted before it could complete") from None
        set_private_params(node)
        if not disable_rosout:
            self.open_rosout()
        if not disable_rostime:
            self.follow_simulated_time()
        if is_on(node, "/enable_statistics"):
            node.enable_statistics(window_limits(node))
        self.has_time = True
        for name in _INTERNAL_LOGGERS:
            logging.getLogger(name)
        serve_loggers(node)
        self.logger.debug("init_node, name[%s], pid[%s]", node.name, os.getpid())
        self.run_deferred(node)

    def run_deferred(self, node: Node) -> None:
        """Run the operations that were deferred until the node exists."""
        with self._lock:
            waiting, self._waiting_for_node = self._waiting_for_node, []
        for action in waiting:
            action(node)

    def open_rosout(self) -> None:
        """Publish log messages on `/rosout`, unless they are already, or there is no node."""
        if self.node is not None and self.rosout_handler is None:
            self.rosout_handler = open_rosout(self.node, self.logger)
            self._log_handlers.append(self.rosout_handler)

    def follow_simulated_time(self) -> None:
        """Use `/clock` if `/use_sim_time` is set.

        Raises:
            ROSInitException: init_node has not been called.
        """
        if self.node is None:
            raise ROSInitException("client code must call rospy.init_node() first")
        if is_on(self.node, "/use_sim_time") and not self.node.clock.is_simulated:
            self.node.use_simulated_time()

    def install_signals(self) -> None:
        """Let SIGINT and SIGTERM end the node, unless they already do. Does nothing without a node.

        Raises:
            ROSInitException: called outside the main thread.
        """
        if self.node is not None and not self._has_signals:
            self._install_signals()
            self._signals.listen(self.node)

    def _install_signals(self) -> None:
        try:
            self._signals.install()
        except NotInMainThread:
            raise ROSInitException(
                "init_node() must be called in the main thread, or with disable_signals=True: "
                "only the main thread can handle signals"
            ) from None
        self._has_signals = True

    def _start_with_signals(self, node: Node) -> None:
        """Start the node. A signal that arrives meanwhile ends it afterwards."""
        self._install_signals()
        try:
            node.start()
        except BaseException:
            self._has_signals = False
            self._signals.uninstall()
            raise
        self.node = node
        self._signals.listen(node)

    # -- the end --------------------------------------------------------------------

    def add_client_hook(self, hook: Hook) -> None:
        self._add(self.client_hooks, hook)

    def add_preshutdown_hook(self, hook: Hook) -> None:
        self._add(self.preshutdown_hooks, hook, "already shutdown")

    def add_shutdown_hook(self, hook: Hook) -> None:
        self._add(self.shutdown_hooks, hook, "already shutdown")

    def join_at_the_end(self, thread: threading.Thread) -> None:
        """Let the shutdown wait for a thread that is still running, for some seconds at most."""
        if not self.is_shutdown:
            self.threads_to_join = [*filter(threading.Thread.is_alive, self.threads_to_join), thread]

    def _add(self, hooks: list[Hook], hook: Hook, *args: object) -> None:
        """Add a hook; after the shutdown, call it at once, as Noetic does."""
        if self.is_shutdown:
            hook(*args)
        else:
            hooks.append(hook)

    def end(self, reason: str) -> None:
        """Shut the node down; see `Node.shutdown`."""
        self._reason = reason
        calls, shutdown_hooks, threads = self.calls, self.shutdown_hooks, self.threads_to_join
        if self.node is not None:
            self.node.shutdown(reason)
        elif not self._is_over:
            self._call_client_hooks()
            self._is_over = True
        calls.interrupt()
        with self._lock:  # each hook is called by one thread only
            hooks = list(shutdown_hooks)
            shutdown_hooks.clear()
        self._call(hooks, reason)
        self._call([partial(thread.join, THREAD_END_S) for thread in threads if thread.is_alive()])

    def _call_client_hooks(self) -> None:
        self._call(self.client_hooks)
        self._call(self.preshutdown_hooks, self._reason)
        for wait in list(self._waits):
            wait.set()

    def _call(self, hooks: Sequence[Hook], *args: object) -> None:
        for hook in list(hooks):
            try:
                hook(*args)
            except Exception:
                self.logger.exception("a shutdown hook failed")

    def _end_by_request(self, reason: str) -> None:
        print(f"shutdown request: {reason}", flush=True)
        self.end(f"external shutdown request: {reason}")


_INTERNAL_LOGGERS = (
    *("rospy", "rospy.client", "rospy.core", "rospy.init", "rospy.internal", "rospy.registration"),
    *("rospy.impl", "rospy.impl.masterslave", "rospy.rosout", "rospy.service", "rospy.simtime"),
    *("rospy.tcpros", "rospy.topics", "rosgraph", "rosgraph.network", "xmlrpc"),
)
"""Loggers that tools expect a rospy node to list; a program may log by them, too."""


def _warn_no_master(node: Node) -> None:
    uri = node.environment.master_uri
    print(
        f"Unable to register with master node [{uri}]: master may not be running yet. Will keep trying.",
        flush=True,
    )


session = Session()
