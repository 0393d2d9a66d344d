"""The one default node of a process, which every name in rospy speaks of.

All state of rospy lives in the one `session` object at the end of this module.
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
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pipros import names
from pipros.env import Environment
from pipros.errors import Interrupted
from pipros.net.master import MasterClient
from pipros.node import Node
from pipros.node.client import OpenCalls
from pipros.node.loggers import serve_loggers
from pipros.node.params import Parameters
from pipros.node.traffic import WindowLimits
from rospy import outputs
from rospy.exceptions import ROSException, ROSInitException, ROSInterruptException
from rospy.signals import Signals

#: The name of a process that has not called init_node.
UNNAMED = "unnamed"

Hook = Callable[..., object]


class InitInterrupted(ROSInitException, ROSInterruptException):
    """The process was told to end while init_node still waited for the master."""


class Session:
    """The life of rospy in this process: before `init_node`, with its node, and after the end."""

    def __init__(self) -> None:
        self.node: Node | None = None
        self.logger = logging.getLogger("rosout")
        self.remappings: Mapping[str, str] = {}
        self.has_time = False
        self.calls = OpenCalls()
        self._init_arguments: tuple[Any, ...] | None = None
        self._waiting_for_node: list[Callable[[Node], object]] = []
        self._client_hooks: list[Hook] = []
        self._preshutdown_hooks: list[Hook] = []
        self._shutdown_hooks: list[Hook] = []
        self._is_over = False  # shut down without ever having had a node
        self._lock = threading.RLock()
        self._signals = Signals(self.end)
        self._early_clients: tuple[str, MasterClient, Parameters] | None = None

    def wait(self, seconds: float) -> None:
        """Waits in wall time; less when the node ends."""
        if self.node is not None:
            self.node.wait_for_shutdown(seconds)
        else:
            time.sleep(seconds)

    # -- before and after init_node ---------------------------------------------

    @property
    def name(self) -> str:
        if self.node is not None:
            return self.node.name
        return Environment.from_os().namespace + UNNAMED

    @property
    def namespace(self) -> str:
        return self.node.namespace if self.node is not None else Environment.from_os().namespace

    @property
    def is_initialized(self) -> bool:
        return self.node is not None and self.has_time

    @property
    def is_shutdown(self) -> bool:
        return self._is_over or (self.node is not None and self.node.is_shutdown)

    @property
    def params(self) -> Parameters:
        """The parameters, also before init_node."""
        return self.node.params if self.node is not None else self._early()[2]

    @property
    def master(self) -> MasterClient:
        """The master, also before init_node."""
        return self.node.master if self.node is not None else self._early()[1]

    def resolve(self, name: str) -> str:
        if self.node is not None:
            return self.node.resolve(name)
        return names.resolve(name, self.name)

    def when_started(self, action: Callable[[Node], object]) -> None:
        """Does something with the node: now, or as soon as there is one."""
        with self._lock:
            if self.node is None:
                self._waiting_for_node.append(action)
                return
        action(self.node)

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
        """What `rospy.init_node` does; its docstring has the details."""
        argv = sys.argv if argv is None else argv
        arguments = (name, list(argv), anonymous, log_level, disable_rostime, disable_signals)
        if not name:
            raise ValueError("name must not be empty")
        if "/" in name:
            raise ValueError("namespaces are not allowed in node names")
        with self._lock:
            if self._init_arguments is not None:
                if self._init_arguments == arguments:
                    return
                raise ROSException(
                    "rospy.init_node() has already been called with different arguments: "
                    f"{self._init_arguments}"
                )
            self._init_arguments = arguments
        try:
            self._start(arguments, disable_rosout, rpc_port, tcpros_port)
        except BaseException:
            if self.node is None:
                self._init_arguments = None
            raise

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
            on_shutdown_request=self._end_as_asked,
            rpc_port=rpc_port,
            tcpros_port=tcpros_port,
        )
        node.at_end(self._call_client_hooks)
        outputs.open_console_and_file(node, self.logger, log_level)
        node.start()
        self.node = node
        if not disable_signals:
            self._signals.take(node)
        self.remappings = {**node.identity.arguments.special, **node.identity.arguments.remappings}
        atexit.register(self.end, "atexit")
        if hasattr(os, "register_at_fork"):  # the end of a child is not the end of the node
            os.register_at_fork(after_in_child=lambda: atexit.unregister(self.end))
        try:
            node.wait_for_master(lambda _: _say_that_there_is_no_master(node))
        except Interrupted:
            raise InitInterrupted("init_node interrupted before it could complete") from None
        if node.identity.arguments.params:
            self._set_private_parameters(node)
        if not disable_rosout:
            outputs.open_rosout(node, self.logger)
        if not disable_rostime and self._is_on(node, "/use_sim_time"):
            node.use_simulated_time()
        if self._is_on(node, "/enable_statistics"):
            node.enable_statistics(self._window_limits(node))
        self.has_time = True
        serve_loggers(node)
        self.logger.debug("init_node, name[%s], pid[%s]", node.name, os.getpid())
        with self._lock:
            waiting, self._waiting_for_node = self._waiting_for_node, []
        for action in waiting:
            action(node)

    def _set_private_parameters(self, node: Node) -> None:
        """Sets what arguments of the form `_name:=yaml` say."""
        from pipros.safe import yaml

        for key, text in node.identity.arguments.params.items():
            node.params.set("~" + key, yaml.load(text))

    def _is_on(self, node: Node, switch: str) -> bool:
        try:
            return node.params.get(switch) is True
        except LookupError:
            return False

    def _window_limits(self, node: Node) -> WindowLimits:
        """The limits that parameters set, the others as they are by default."""
        given: dict[str, Any] = {}
        for field, parameter in _WINDOW_PARAMETERS.items():
            with contextlib.suppress(LookupError):
                value = node.params.get(f"/statistics_window_{parameter}")
                if isinstance(value, (int, float)) and value > 0:
                    given[field] = value
        return WindowLimits(**given)

    # -- the end --------------------------------------------------------------------

    def add_client_hook(self, hook: Hook) -> None:
        self._client_hooks.append(hook)

    def add_preshutdown_hook(self, hook: Hook) -> None:
        self._preshutdown_hooks.append(hook)

    def add_shutdown_hook(self, hook: Hook) -> None:
        self._shutdown_hooks.append(hook)

    def end(self, reason: str) -> None:
        """Shuts the node down; see `Node.shutdown`."""
        self._reason = reason
        if self.node is None:
            if not self._is_over:
                self._call_client_hooks()
                self._is_over = True
            return
        self.node.shutdown(reason)
        self.calls.interrupt()
        hooks, self._shutdown_hooks = self._shutdown_hooks, []
        self._call(hooks, reason)

    def _call_client_hooks(self) -> None:
        self._call(self._client_hooks)
        self._call(self._preshutdown_hooks, self._reason)

    def _call(self, hooks: Sequence[Hook], *args: object) -> None:
        for hook in list(hooks):
            try:
                hook(*args)
            except Exception:
                self.logger.exception("a shutdown hook failed")

    def _end_as_asked(self, reason: str) -> None:
        print(f"shutdown request: {reason}", flush=True)
        self.end(f"external shutdown request: {reason}")


_WINDOW_PARAMETERS = {
    "min_elements": "min_elements",
    "max_elements": "max_elements",
    "min_size_s": "min_size",
    "max_size_s": "max_size",
}


def _say_that_there_is_no_master(node: Node) -> None:
    uri = node.environment.master_uri
    print(
        f"Unable to register with master node [{uri}]: master may not be running yet. Will keep trying.",
        flush=True,
    )


session = Session()
