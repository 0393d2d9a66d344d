"""Nodes on other machines. The launch itself starts each by ssh, without a launch child."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from pipros.basics.lazy_names import star_names as _star_names
from roslaunch.core import RLException, is_machine_local, printerrlog, printlog
from roslaunch.launch import ROSRemoteRunnerIF
from roslaunch.nodeprocess import DEFAULT_TIMEOUT_SIGINT, DEFAULT_TIMEOUT_SIGTERM
from roslaunch.pmon import ProcessListener, ProcessMonitor
from roslaunch.remoteprocess import SSHChildROSLaunchProcess
from roslaunch.server import ROSLaunchParentNode

if TYPE_CHECKING:
    from roslaunch.config import ROSLaunchConfig

__all__ = [
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "RLException",
    "ROSRemoteRunner",
    "SSHChildROSLaunchProcess",
    "is_machine_local",
    "printerrlog",
    "printlog",
]

_star_names(__name__, "logging rosgraph.network roslaunch socket time")


class ROSRemoteRunner(ROSRemoteRunnerIF):
    """The nodes of a configuration that run on other machines.

    They need no separate start: a `ROSLaunchParent` starts them with all others.

    Attributes:
        remote_nodes: pairs of a machine and its nodes.
    """

    def __init__(
        self,
        run_id: str,
        rosconfig: ROSLaunchConfig,
        pm: ProcessMonitor,
        server: ROSLaunchParentNode,
        sigint_timeout: float = DEFAULT_TIMEOUT_SIGINT,
        sigterm_timeout: float = DEFAULT_TIMEOUT_SIGTERM,
    ) -> None:
        self.logger = logging.getLogger("roslaunch.remote")
        self.run_id = run_id
        self.rosconfig = rosconfig
        self.pm = pm
        self.server = server
        self.sigint_timeout = sigint_timeout
        self.sigterm_timeout = sigterm_timeout
        self.remote_processes: list[SSHChildROSLaunchProcess] = []
        self.listeners: list[ProcessListener] = []
        self.machine_list = [
            machine
            for machine in rosconfig.machines.values()
            if machine.name and not is_machine_local(machine)
        ]
        self.remote_nodes = [
            (machine, [node for node in rosconfig.nodes if node.machine_name == machine.name])
            for machine in self.machine_list
        ]

    def add_process_listener(self, l: ProcessListener) -> None:  # noqa: E741  # Noetic's name
        self.listeners.append(l)
        self.server.add_process_listener(l)

    def start_children(self) -> None:
        """Do nothing, because nodes on other machines need no launch child."""

    def launch_remote_nodes(self) -> tuple[list[str], list[str]]:
        """Return the names of the running nodes on other machines, and of the nodes that are not running."""
        nodes = [node for _, nodes in self.remote_nodes for node in nodes]
        running = self.pm.get_active_names()
        started = [node.process_name or "" for node in nodes if node.process_name in running]
        return started, [node.name or "" for node in nodes if node.process_name not in running]
