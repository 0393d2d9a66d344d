"""The XML-RPC server through which other programs query the processes of a running roslaunch."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_client import RpcClient
from pipros.net.rpc_server import Method, RpcServer
from pipros.net.this_machine import ThisMachineCaller
from pipros_tools.launch.managed_node import ProcessInfo
from pipros_tools.launch.model import LaunchError


class LaunchServer:
    """Serves the methods that Noetic's roslaunch offers to tools.

    The methods return the launcher's process id, its processes and its nodes.
    """

    def __init__(
        self,
        environment: Environment,
        processes: Callable[[], Sequence[ProcessInfo]],
        methods: Mapping[str, Method] | None = None,
        *,
        admits: Callable[[ThisMachineCaller], bool] | None = None,
    ) -> None:
        """Store the settings; `start` opens the port.

        Args:
            processes: function that returns the current processes; called from another thread.
            methods: additional methods.
            admits: function that returns whether a caller may connect; by default, all callers may.

        Raises:
            InvalidEnvironment: `PIPROS_PORTS` or `PIPROS_ADVERTISE` has an invalid value.
        """
        self._advertised = address.advertised_address(environment)
        self._has_outside_address = environment.advertise is not None
        self._processes = processes
        self._loop = BackgroundLoop("roslaunch server")
        self._rpc = RpcServer(
            {
                "get_pid": lambda: [1, str(os.getpid()), os.getpid()],
                "list_processes": self._list_processes,
                "process_info": self._process_info,
                "get_node_names": self._node_names,
                **(methods or {}),
            },
            host=address.bind_host(environment),
            port=environment.port_range or 0,
            admits=admits,
        )

    @property
    def uri(self) -> str:
        return address.uri(*self._advertised.outside(self._rpc.port))

    @property
    def parameter(self) -> str:
        """The parameter that holds the URI, such as `/roslaunch/uris/host_127_0_0_1__4711`."""
        host, port = self._advertised.outside(self._rpc.port)
        for character in ".-:":
            host = host.replace(character, "_")
        return f"/roslaunch/uris/host_{host}__{port}"

    def start(self) -> None:
        """Open a free port. The server accepts calls by the time this method returns.

        Raises:
            OSError: no port is free, or the address does not belong to this computer.
        """
        self._loop.start()
        try:
            self._loop.run(self._rpc.start())
        except BaseException:
            self._loop.stop()
            raise

    def check_address(self, timeout_s: float) -> None:
        """Check that the server can be reached at the advertised address.

        Do nothing if `PIPROS_ADVERTISE` is set, because a router may forward only connections from outside.

        Raises:
            LaunchError: the server cannot be reached at this address.
        """
        if self._has_outside_address:
            return
        try:
            with RpcClient(self.uri, timeout_s=timeout_s) as client:
                client.call("get_pid")
        except (PiprosError, ValueError) as error:
            raise LaunchError(
                f"Unable to contact my own server at [{self.uri}].\n{error}.\n"
                "Other computers use this address. Set ROS_HOSTNAME or ROS_IP to a "
                "name or an address that this computer has, or unset both."
            ) from None

    def stop(self) -> None:
        self._loop.run(self._rpc.stop())
        self._loop.stop()

    def _list_processes(self) -> list[Any]:
        """Return the names and spawn counts of the running processes, then of the ended processes."""
        lists: tuple[list[Any], list[Any]] = ([], [])
        for process in self._processes():
            lists[0 if process.is_alive else 1].append([process.name, process.spawn_count])
        return [1, "processes on parent machine", list(lists)]

    def _process_info(self, name: str) -> list[Any]:
        for process in self._processes():
            if process.name == name:
                return [1, "process info", process.as_struct()]
        return [-1, "no process by that name", {}]

    def _node_names(self) -> list[Any]:
        return [1, "node names", [process.name for process in self._processes() if process.is_alive]]
