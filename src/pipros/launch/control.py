"""Lets this user's other programs list, stop and restart a running roslaunch's nodes, and read their output.

Each roslaunch listens on a Unix socket, `$ROS_HOME/pipros/launches/<process id>`. It responds only to
this user and root, as identified by the operating system. Other users can reach only the XML-RPC server,
which has no methods that stop or restart nodes. Each connection carries one request and one response, both
JSON:

    {"do": "list"}                           {"run_id": …, "files": […], "nodes": […], "more": 0}
    {"do": "output", "node": "talker-2"}     {"output": [["/…/talker-2-stdout.log", "…"]]}
    {"do": "stop" or "restart", "node": …}   {}

All requests except `list` also contain the `run_id`, so that a page for another master cannot affect this
launch. The response to a refused request is `{"error": "…"}`.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from pipros.basics.cache_files import CacheFolder
from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_end
from pipros.basics.limits import limit_text, process_limits
from pipros.launch.managed_node import ManagedNode
from pipros.launch.model import LaunchError
from pipros.launch.run import LaunchRun
from pipros.net import local_socket
from pipros.packages import cache_folder

MAX_NODES: Final = 1000
OUTPUT_BYTES: Final = 65_536
"""Maximum number of bytes that are returned from the end of a log file."""
_FOLDER: Final = "launches"
_REQUEST_BYTES: Final = 65_536
_TIMEOUT_S: Final = 5.0
_PAUSE_S: Final = 0.1
_CHUNK_BYTES: Final = 65_536


class LaunchUnavailable(PiprosError):
    """A roslaunch process has ended, does not respond, or refuses a request."""


class LaunchControl:
    """The socket of one roslaunch, with a thread that answers requests."""

    def __init__(self, run_id: str, files: Sequence[str], run: LaunchRun) -> None:
        """Store the arguments; `start` creates the socket."""
        self._about = {"run_id": run_id, "files": list(files)}
        self._run = run
        self._name = str(os.getpid())
        self._folder = _folder()
        self._server: socket.socket | None = None
        self._is_closed = threading.Event()

    def start(self) -> None:
        """Create the socket, and answer requests in another thread.

        Raises:
            OSError: the socket cannot be created, or this system does not support Unix sockets.
        """
        local_socket.remove_dead(self._folder)
        self._server = local_socket.listen(self._folder, self._name)
        threading.Thread(target=self._serve, args=(self._server,), name="control", daemon=True).start()

    def stop(self) -> None:
        """Remove the socket. May be called even if there is none."""
        server, self._server = self._server, None
        if server is None:
            return
        self._is_closed.set()
        with contextlib.suppress(OSError):
            self._folder.remove(self._name)
        with contextlib.suppress(OSError):
            server.shutdown(socket.SHUT_RDWR)  # makes the thread's `accept` return
        server.close()

    def _serve(self, server: socket.socket) -> None:
        while True:
            try:
                connection, _ = server.accept()
            except OSError:  # the socket was closed, or this process has too many open files
                if self._is_closed.wait(_PAUSE_S):
                    return
                continue
            with connection, contextlib.suppress(OSError):
                connection.settimeout(_TIMEOUT_S)
                if local_socket.is_own(connection):
                    connection.sendall(json.dumps(self._answer(connection)).encode())

    def _answer(self, connection: socket.socket) -> Mapping[str, Any]:
        try:
            request = json.loads(_received(connection, _REQUEST_BYTES, f"the limit is {_REQUEST_BYTES}"))
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
        except (PiprosError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            return {"error": str(error) or type(error).__name__}
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
        if not any(text for _, text in found):  # the node wrote to the terminal itself, but also to its log
            found.append(_end_of(Path(f"{self._run.log_stem(process.name)}.log")))
        return [[source, text] for source, text in found if text]


def running_launches() -> list[str]:
    """Return the process ids of this user's roslaunch processes that have sockets, as decimal strings.

    A process that was killed may still be listed.

    Raises:
        OSError: the folder cannot be read, or other users could write to it.
    """
    try:
        return sorted(name for name in _folder().names() if name.isdecimal())
    except FileNotFoundError:
        return []


def ask(launch: str, request: Mapping[str, Any]) -> Mapping[str, Any]:
    """Send a request to the roslaunch with the process id `launch`, and return its response.

    May block for several seconds.

    Raises:
        LaunchUnavailable: the process has ended, does not respond, or refuses the request.
    """
    limit = process_limits().launch_answer_bytes
    try:
        with local_socket.connect(_folder(), launch, _TIMEOUT_S) as connection:
            connection.sendall(json.dumps(request).encode())
            connection.shutdown(socket.SHUT_WR)
            text = _received(connection, limit, limit_text("launch_answer_bytes", limit))
            answer = json.loads(text)
    except (FileNotFoundError, ConnectionError):
        raise LaunchUnavailable(f"roslaunch {launch} has ended") from None
    except (OSError, ValueError, RecursionError) as error:
        raise LaunchUnavailable(f"roslaunch {launch} does not answer: {error}") from None
    if not isinstance(answer, dict) or "error" in answer:
        problem = answer.get("error") if isinstance(answer, dict) else "malformed answer"
        raise LaunchUnavailable(str(problem))
    return answer


def _received(connection: socket.socket, limit: int, advice: str) -> bytes:
    """Return everything that the other side sends until it closes the stream.

    Raises:
        ValueError: the other side sends more than `limit` bytes.
    """
    text = bytearray()
    while chunk := connection.recv(_CHUNK_BYTES):
        text += chunk
        if len(text) > limit:
            raise ValueError(f"too long; {advice}")
    return bytes(text)


def _values(managed: ManagedNode) -> Mapping[str, Any]:
    info = managed.info()
    return {
        "name": managed.name,
        "node": managed.node.full_name,
        "program": f"{info.package}/{managed.node.type}",
        "state": managed.state.value,
        "pid": info.pid,
        "exit_code": info.exit_code,
        "starts": info.spawn_count,
        "respawn": info.respawn,
        "required": info.required,
    }


def _end_of(file: Path) -> list[str]:
    try:
        return [str(file), read_end(file, OUTPUT_BYTES)]
    except OSError:
        return [str(file), ""]


def _folder() -> CacheFolder:
    return CacheFolder(os.path.abspath(cache_folder(_FOLDER)))
