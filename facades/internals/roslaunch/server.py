"""XML-RPC servers of launchers, called by tools that list processes and by launch parents and children."""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, Any

from pipros.basics.lazy_names import star_names as _star_names
from pipros.launch.session import LaunchSession
from rosgraph.xmlrpc import XmlRpcHandler, XmlRpcNode
from roslaunch.core import (
    RLException,
    add_printerrlog_handler,
    add_printlog_handler,
    printerrlog,
    printlog,
    printlog_bold,
)
from roslaunch.launch import ROSLaunchRunner
from roslaunch.nodeprocess import DEFAULT_TIMEOUT_SIGINT, DEFAULT_TIMEOUT_SIGTERM
from roslaunch.pmon import Process, ProcessListener, ProcessMonitor

if TYPE_CHECKING:
    from roslaunch.config import ROSLaunchConfig

__all__ = [
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "Process",
    "ProcessListener",
    "RLException",
    "ROSLaunchBaseHandler",
    "ROSLaunchNode",
    "ROSLaunchParentHandler",
    "ROSLaunchParentNode",
    "ROSLaunchRunner",
    "add_printerrlog_handler",
    "add_printlog_handler",
    "printerrlog",
    "printlog",
    "printlog_bold",
]

_star_names(
    __name__,
    "errno rosgraph_msgs.msg:Log logging os rosgraph.network rosgraph.xmlrpc roslaunch "
    "xmlrpc.client:ServerProxy socket sys time traceback urllib.parse:urlparse",
)

Answer = tuple[int, str, Any]


class ROSLaunchBaseHandler(XmlRpcHandler):
    """XML-RPC methods of every launcher, which return its process ID, processes and nodes."""

    def __init__(self, pm: ProcessMonitor) -> None:
        if pm is None:
            raise RLException("cannot create xmlrpc handler: pm is not initialized")
        self.pm = pm
        self.logger = logging.getLogger("roslaunch.server")

    def list_processes(self) -> Answer:
        """Return the names and spawn counts of the running processes, then of the exited processes."""
        return 1, "processes on parent machine", self.pm.get_process_names_with_spawn_count()

    def process_info(self, process_name: str) -> Answer:
        """Return information about a process."""
        process = self.pm.get_process(process_name)
        if process is None:
            return -1, "no process by that name", {}
        info = process.get_info()
        return 1, "process info", {**info, "env": dict(info["env"]), "args": list(info["args"])}

    def get_pid(self) -> Answer:
        """Return the launcher's process ID."""
        return 1, str(os.getpid()), os.getpid()

    def get_node_names(self) -> Answer:
        """Return the names of the running processes."""
        return 1, "node names", self.pm.get_active_names()


class ROSLaunchParentHandler(ROSLaunchBaseHandler):
    """XML-RPC methods of the parent process, called by tools and by child launchers."""

    def __init__(
        self,
        pm: ProcessMonitor,
        child_processes: dict[str, Any],
        listeners: list[ProcessListener],
    ) -> None:
        super().__init__(pm)
        self.child_processes = child_processes
        self.listeners = listeners

    def register(self, client: str, uri: str) -> Answer:
        """Register the URI of a child's server. Called by the child."""
        child = self.child_processes.get(client)
        if child is None:
            return -1, f"unknown child [{client}]", 0
        child.set_uri(uri)
        return 1, "registered", 1

    def list_children(self) -> Answer:
        """Return the URIs of the registered children."""
        uris = [child.uri for child in self.child_processes.values() if child.uri is not None]
        return 1, "roslaunch children", uris

    def process_died(self, process_name: str, exit_code: int) -> Answer:
        """Notify the listeners that a child's process has exited. Called by the child."""
        for listener in self.listeners:
            listener.process_died(process_name, exit_code)
        return 1, "", 0

    def log(self, client: str, level: int, message: str) -> Answer:
        """Print a child's message.

        `level` is a severity constant of rosgraph_msgs/Log; 8 and above are errors.
        """
        (printerrlog if level >= _ERROR else printlog)(f"[{client}]: {message}")
        return 1, "", 1


_ERROR = 8


class ROSLaunchNode(XmlRpcNode):
    """Server on a free port. The handler's methods can be called as soon as `start` returns."""

    def __init__(self, handler: ROSLaunchBaseHandler | None) -> None:
        super().__init__(0, handler)

    def run(self) -> None:
        """Do nothing, for compatibility. After `start`, the server runs in its own thread."""


class ROSLaunchParentNode(ROSLaunchNode):
    """A launch parent's server.

    Attributes:
        rosconfig: the launched configuration.
        listeners: notified when processes on other machines exit.
        child_processes: the launch children, by name.
    """

    def __init__(self, rosconfig: ROSLaunchConfig, pm: ProcessMonitor) -> None:
        self.rosconfig = rosconfig
        self.listeners: list[ProcessListener] = []
        self.child_processes: dict[str, Any] = {}
        if pm is None:
            raise RLException("cannot create parent node: pm is not initialized")
        super().__init__(ROSLaunchParentHandler(pm, self.child_processes, self.listeners))

    @classmethod
    def of_session(
        cls, session: LaunchSession, rosconfig: ROSLaunchConfig, pm: ProcessMonitor
    ) -> ROSLaunchParentNode:
        """Return the server of a running launch. The launch opened the server and will close it."""
        node = cls(rosconfig, pm)
        if session.server is not None:
            node.set_uri(session.server.uri)
        return node

    def add_child(self, name: str, p: Any) -> None:
        """Add a launch child, which will register under this name."""
        self.child_processes[name] = p

    def add_process_listener(self, l: ProcessListener) -> None:  # noqa: E741  # Noetic's name
        """Add a listener that is notified when processes on other machines exit."""
        self.listeners.append(l)
