"""The process's default node, which rospy's module-level functions use.

All of rospy's state is in the `session` object at the end of this module.
"""

from __future__ import annotations

import atexit
import os
import threading
import time
from collections.abc import Callable
from typing import Any, Protocol
from weakref import WeakSet

from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.node.clock import Clock, SimulatedClock, WallClock
from pipros.node.identity import Identity
from pipros.node.log import ros_logger
from pipros.node.open_calls import OpenCalls
from pipros.node.params import Parameters
from pipros.node.start_params import is_on
from rospy.before_init import BeforeInit
from rospy.exceptions import ROSInitException
from rospy.node_logs import NodeLogs
from rospy.noetic_globals import NoeticGlobals
from rospy.shutdown_hooks import Hook, ShutdownHooks
from rospy.signal_handlers import SignalHandlers


class Closable(Protocol):
    """An object that is closed together with its node, such as a `rospy.Publisher`."""

    def close(self) -> None: ...


class Session:
    """The process's node: before `init_node`, while it is running, and after its shutdown.

    Attributes:
        before: names, parameters and deferred operations while there is no node.
        hooks: the node's shutdown hooks.
        logs: the node's log handlers.
        globals: values that packages assign to variables of Noetic's modules.
        init_arguments: the arguments of `init_node`. If set to None, `init_node` can start another node.
    """

    def __init__(self) -> None:
        self.logger = ros_logger("rosout")
        self.has_time = False
        self.init_arguments: tuple[Any, ...] | None = None
        self.publishers: WeakSet[Closable] = WeakSet()  # every rospy.Publisher
        self.before = BeforeInit()
        self.logs = NodeLogs(self.logger)
        self.globals = NoeticGlobals(self)
        self.lock = threading.RLock()
        self.signals = SignalHandlers(self.end)
        self.process_id = 0  # identifies the process that called init_node
        self.end_reason = ""
        self._reset_node_state()

    def _reset_node_state(self) -> None:
        self.node: Node | None = None
        self.calls = OpenCalls()
        self.hooks = ShutdownHooks(self.logger)
        self.services: dict[str, Any] = {}  # the registered instances of rospy.Service, by name
        self._is_over = False  # true after a shutdown without a node, or if a package set it
        self.before.reset()
        self.globals.reset()

    def wait(self, seconds: float) -> None:
        """Wait for a wall-clock duration. Return early if the node shuts down."""
        if self.node is not None:
            self.node.wait_for_shutdown(seconds)
        else:
            time.sleep(seconds)

    # -- before and after init_node ---------------------------------------------

    @property
    def identity(self) -> Identity:
        """The node's names; before `init_node`, the names of a process without a node."""
        return self.before.identity_of(self.node)

    @property
    def name(self) -> str:
        return self.identity.name

    @property
    def namespace(self) -> str:
        return self.identity.namespace

    @property
    def is_shutdown(self) -> bool:
        return self._is_over or (self.node is not None and self.node.is_shutdown)

    def set_shutdown(self, value: bool) -> None:
        """Handle an assignment to the shutdown flag.

        Assigning False after a shutdown restores the state before `init_node`.
        """
        if not value and self.node is not None and self.node.is_shutdown:
            self.forget_node()
        self._is_over = value

    @property
    def clock(self) -> Clock:
        """The node's clock; before `init_node`, the process's clock."""
        return self.before.clock if self.node is None else self.node.clock

    def set_sim_time(self, now_ns: int) -> None:
        """Switch to a simulated clock and set its time."""
        clock = self.clock
        if not isinstance(clock, SimulatedClock):
            clock = SimulatedClock()
            self._replace_clock(clock)
        clock.set_ns(now_ns)

    def use_wall_clock(self) -> None:
        """Switch to wall time."""
        if self.clock.is_simulated:
            self._replace_clock(WallClock())

    def _replace_clock(self, clock: Clock) -> None:
        if self.node is None:
            self.before.clock, before = clock, self.before.clock
            before.interrupt()
        else:
            self.node.use_clock(clock)

    @property
    def params(self) -> Parameters:
        """The parameters; also available before init_node."""
        return self.node.params if self.node is not None else self.before.params

    @property
    def master(self) -> MasterClient:
        """The master; also available before init_node."""
        return self.node.master if self.node is not None else self.before.master

    def resolve(self, name: str) -> str:
        return self.identity.resolve(name)

    def resolve_topic(self, name: str) -> str:
        """Resolve and remap a topic, and return its global name. Remappings also apply before `init_node`.

        Raises:
            InvalidName: the name is private and `init_node` has not been called.
        """
        if self.node is not None:
            return self.identity.resolve(name)
        return self.identity.resolve_topic_without_name(name)

    def when_started(self, action: Callable[[Node], object]) -> None:
        """Call `action` with the node, immediately or as soon as the node has started."""
        with self.lock:
            if self.node is None:
                self.before.defer(action)
                return
        action(self.node)

    # -- the node -----------------------------------------------------------------

    def forget_node(self) -> None:
        """Restore the state before `init_node`. Objects created for the node stay closed.

        A running node is shut down first, unless it belongs to the parent of this forked process.
        """
        if os.getpid() == self.process_id:
            self.end("another node takes its place")
        else:
            self.signals.forget()
        self.logs.close()
        for publisher in self.publishers:
            publisher.close()
        self.publishers.clear()
        self._reset_node_state()

    def run_deferred(self, node: Node) -> None:
        """Run the operations that were deferred until the node started."""
        with self.lock:
            deferred = self.before.take_deferred()
        for action in deferred:
            action(node)

    def follow_simulated_time(self) -> None:
        """Use `/clock` if `/use_sim_time` is true.

        Raises:
            ROSInitException: init_node has not been called.
        """
        if self.node is None:
            raise ROSInitException("client code must call rospy.init_node() first")
        if is_on(self.node, "/use_sim_time") and not self.node.clock.is_simulated:
            self.node.use_simulated_time()

    def install_signals(self) -> None:
        """Make SIGINT and SIGTERM shut the node down.

        Do nothing if there is no node or the handlers are already installed.

        Raises:
            ROSInitException: called outside the main thread.
        """
        if self.node is not None and not self.signals.are_installed:
            self.signals.install()
            self.signals.listen(self.node)

    # -- shutdown -------------------------------------------------------------------

    def call_or_add(self, hooks: list[Hook], hook: Hook, *args: object) -> None:
        """Add a hook. After the shutdown, call the hook immediately with `args`, as in Noetic."""
        if self.is_shutdown:
            hook(*args)
        else:
            hooks.append(hook)

    def end(self, reason: str) -> None:
        """Shut the node down; see `Node.shutdown`."""
        self.end_reason = reason
        calls, hooks = self.calls, self.hooks
        if self.node is not None:
            self.node.shutdown(reason)
        elif not self._is_over:
            hooks.call_first(reason)
            self._is_over = True
        calls.interrupt()
        hooks.call_last(reason)

    def end_at_exit(self) -> None:
        if self.process_id in (0, os.getpid()):  # the exit of a forked child must not end the node
            self.end("atexit")

    def end_by_request(self, reason: str) -> None:
        print(f"shutdown request: {reason}", flush=True)
        self.end(f"external shutdown request: {reason}")


session = Session()
atexit.register(session.end_at_exit)  # first, so that handlers of the program can still publish
