"""The XML-RPC server by which other programs can ask a running roslaunch for its processes."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

from pipros.env import Environment
from pipros.net import address
from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_server import RpcServer


class LaunchServer:
    """Answers what Noetic's roslaunch answers to tools: its process number, its processes, its nodes."""

    def __init__(self, environment: Environment, running: Callable[[], Mapping[str, int]]) -> None:
        """Nothing is opened yet. `running` gives names and process numbers; another thread calls it."""
        self._environment = environment
        self._running = running
        self._loop = BackgroundLoop("roslaunch server")
        self._rpc = RpcServer(
            {
                "get_pid": lambda: [1, "pid", os.getpid()],
                "list_processes": self._list_processes,
                "get_node_names": lambda: [1, "node names", sorted(self._running())],
                "list_children": lambda: [1, "roslaunch children", []],
            },
            host=address.bind_host(environment),
        )

    @property
    def uri(self) -> str:
        return address.uri(address.advertised_host(self._environment), self._rpc.port)

    @property
    def parameter(self) -> str:
        """The parameter under which the address is published: `/roslaunch/uris/host_127_0_0_1__4711`."""
        host = address.advertised_host(self._environment)
        for character in ".-:":
            host = host.replace(character, "_")
        return f"/roslaunch/uris/host_{host}__{self._rpc.port}"

    def start(self) -> None:
        """Opens a free port and answers.

        Raises:
            OSError: no port, or no such address on this computer.
        """
        self._loop.start()
        try:
            self._loop.run(self._rpc.start())
        except BaseException:
            self._loop.stop()
            raise

    def stop(self) -> None:
        self._loop.run(self._rpc.stop())
        self._loop.stop()

    def _list_processes(self) -> list[Any]:
        alive = [[name, 0] for name in sorted(self._running())]
        return [1, "processes on parent machine", [alive, []]]
