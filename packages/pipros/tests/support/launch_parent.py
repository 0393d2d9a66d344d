"""A fake roslaunch parent, which starts nodes through a `roslaunch --child`."""

import asyncio
import subprocess
from typing import Any

from pipros.net.loop import BackgroundLoop
from pipros.net.rpc_client import RpcClient
from pipros.net.rpc_server import RpcServer
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


class Parent:
    """The XML-RPC server of a parent.

    Attributes:
        calls: the calls from the child, in order, except liveness checks.
        is_mute: whether to leave liveness checks unanswered.
    """

    def __init__(self) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.is_mute = False
        self._loop = BackgroundLoop("parent")
        self._rpc = RpcServer(
            {
                "register": lambda name, uri: self._note(("register", name, uri), 1),
                "log": lambda name, level, text: self._note(("log", name, level, text), 1),
                "process_died": lambda process, code: self._note(("process_died", process, code), 0),
                "get_pid": self._get_pid,
            }
        )
        self._loop.start()
        self._loop.run(self._rpc.start())
        self.uri = f"http://127.0.0.1:{self._rpc.port}/"

    def _note(self, call: tuple[Any, ...], value: int) -> list[Any]:
        self.calls.append(call)
        return [1, "", value]

    async def _get_pid(self) -> list[Any]:
        if self.is_mute:
            await asyncio.Event().wait()
        return [1, "1", 1]

    @property
    def child(self) -> RpcClient:
        """A client for the child's server; waits until the child has registered."""
        registered = wait_until(lambda: [call for call in self.calls if call[0] == "register"])
        return RpcClient(registered[0][2], timeout_s=30.0)

    @property
    def shown(self) -> list[tuple[int, str]]:
        """The levels and texts of the log messages from the child."""
        return [(call[2], call[3]) for call in self.calls if call[0] == "log"]

    def close(self) -> None:
        """Close the server, so that the child loses its parent."""
        self._loop.run(self._rpc.stop())

    def end(self) -> None:
        self.close()
        self._loop.stop()


def start(ros: RosSystem, parent: Parent, stdin: int = subprocess.DEVNULL) -> Process:
    return ros.pipros.processes.start(
        "roslaunch", "-c", "far-0", "-u", parent.uri, "--run_id", "run", stdin=stdin
    )


def launch(parent: Parent, *nodes: tuple[str, str], more: str = "") -> Any:
    """Start nodes with these names and types through the child, and return its reply.

    Args:
        more: further XML attributes for all nodes.
    """
    written = "".join(f'<node pkg="programs" name="{name}" type="{kind}" {more}/>' for name, kind in nodes)
    return parent.child.call("launch", f"<launch>{written}</launch>")
