"""Let this user's other programs list, stop and restart a running roslaunch's nodes, and read their output.

Each roslaunch answers requests from this user's programs (`net/local_requests.py`). Other users can reach
only the XML-RPC server, which has no methods that stop or restart nodes. Requests and responses:

    {"do": "list"}                           {"run_id": …, "files": […], "nodes": […], "more": 0}
    {"do": "output", "node": "talker-2"}     {"output": [["/…/talker-2-stdout.log", "…"]]}
    {"do": "stop" or "restart", "node": …}   {}

All requests except `list` also contain the `run_id`, so that a page for another master cannot affect this
launch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_end
from pipros.net import local_requests
from pipros.net.local_requests import LocalFailed, LocalServer
from pipros_tools.launch.managed_node import ManagedNode
from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.run import LaunchRun

LAUNCH_ANSWER_BYTES = 4 * 1024 * 1024
"""Limit: a response from roslaunch to the web page, with its nodes or one node's output. Beyond it, the page
reports that roslaunch does not respond, and names the limit.
"""

MAX_NODES: Final = 1000
OUTPUT_BYTES: Final = 65_536
"""Maximum number of bytes that are returned from the end of a log file."""
_FOLDER: Final = "launches"


class LaunchUnavailable(PiprosError):
    """A roslaunch process has ended, does not respond, or refuses a request."""


class LaunchControl:
    """Answers requests about one roslaunch."""

    def __init__(self, run_id: str, files: Sequence[str], run: LaunchRun) -> None:
        """Store the arguments; `start` creates the socket."""
        self._about = {"run_id": run_id, "files": list(files)}
        self._run = run
        self._server = LocalServer(_FOLDER, self._answer)

    def start(self) -> None:
        """Answer requests in another thread.

        Raises:
            OSError: the socket cannot be created, or this system does not support Unix sockets.
        """
        self._server.start()

    def stop(self) -> None:
        """Stop answering requests. May be called even if `start` was not called."""
        self._server.stop()

    def _answer(self, request: Any) -> Mapping[str, Any]:
        wanted, node = request["do"], request.get("node", "")
        if wanted == "list":
            return self._list()
        if request.get("run_id") != self._about["run_id"]:
            raise LaunchError("this launch belongs to another master")
        if wanted == "output":
            return {"output": self._output(node)}
        if wanted == "stop":
            self._run.stop_node(node)
        elif wanted == "restart":
            self._run.restart_node(node)
        else:
            raise LaunchError(f"do must be list, output, stop or restart, got {wanted!r:.100}")
        return {}

    def _list(self) -> Mapping[str, Any]:
        managed = self._run.managed()
        nodes = [_values(node) for node in managed[:MAX_NODES]]
        return {**self._about, "nodes": nodes, "more": max(0, len(managed) - MAX_NODES)}

    def _output(self, name: object) -> list[list[str]]:
        """Return each source of a node's output, `terminal` or a log file, with the end of that output."""
        managed = next((node for node in self._run.managed() if node.name == name), None)
        process = managed.latest if managed is not None else None
        if process is None:
            raise LaunchError(f"there is no node [{name}] in this launch")
        found = [["terminal", process.recent_output.decode("utf-8", "replace")]]
        found += [_end_of(file) for file in (process.stdout_log, process.stderr_log) if file is not None]
        if not any(text for _, text in found):  # the node wrote directly to the terminal, but also to its log
            found.append(_end_of(Path(f"{self._run.log_stem(process.name)}.log")))
        return [[source, text] for source, text in found if text]


def running_launches() -> list[str]:
    """Return the process ids of this user's roslaunch processes; see `local_requests.running`."""
    return local_requests.running(_FOLDER)


def ask(launch: str, request: Mapping[str, Any]) -> Mapping[str, Any]:
    """Send a request to the roslaunch with the process id `launch`, and return its response.

    May block for several seconds.

    Raises:
        LaunchUnavailable: the process has ended, does not respond, or refuses the request.
    """
    limit = LAUNCH_ANSWER_BYTES
    try:
        return local_requests.ask(_FOLDER, launch, request, limit, f"the limit is {limit} bytes")
    except LocalFailed as error:
        text = f"roslaunch {launch} has ended" if error.has_ended else str(error)
        raise LaunchUnavailable(text.replace("process", "roslaunch", 1)) from None


def _values(managed: ManagedNode) -> Mapping[str, Any]:
    info, node = managed.info(), managed.node
    return {
        "name": managed.name,
        "node": node.full_name,
        "program": f"{node.package}/{node.type}",
        "state": managed.state.value,
        "pid": info.pid,
        "exit_code": info.exit_code,
        "starts": info.spawn_count,
        "respawn": node.respawn,
        "required": node.required,
    }


def _end_of(file: Path) -> list[str]:
    try:
        return [str(file), read_end(file, OUTPUT_BYTES)]
    except OSError:
        return [str(file), ""]
