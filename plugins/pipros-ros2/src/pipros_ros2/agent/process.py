"""The process of the agent: its environment, its start and end, and the frames to and from it."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, BinaryIO, Final, cast

from pipros_ros2.agent import rclpy_agent
from pipros_ros2.agent.rclpy_agent import HEADER, Kind, read_frame
from pipros_ros2.interface import EngineError
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange
from pipros_workspace.client_library import without_libraries

START_S: Final = 60.0
"""Timeout of the start, which imports rclpy."""
_END_S: Final = 1.0
_NETWORK: Final = (
    *("ROS_DISCOVERY_SERVER", "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"),
    "CYCLONEDDS_URI",
)
_RMWS: Final = ("", "rmw_fastrtps_cpp", "rmw_fastrtps_dynamic_cpp", "rmw_cyclonedds_cpp")


def reaches_out(discovery: Discovery, variables: Mapping[str, str]) -> bool:
    """Return whether rclpy may reach other machines, because of its discovery range or of other settings."""
    is_unknown = variables.get("RMW_IMPLEMENTATION", "") not in _RMWS
    return discovery.reaches_out or is_unknown or any(map(variables.get, _NETWORK))


def agent_environment(discovery: Discovery, variables: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of the agent.

    Of PYTHONPATH, only the folders of ROS 2 remain: those of ROS 1 have packages of the same names.
    """
    prefixes = [each for each in variables.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if each]
    folders = [
        folder
        for folder in variables.get("PYTHONPATH", "").split(os.pathsep)
        if folder and any(Path(folder).is_relative_to(prefix) for prefix in prefixes)
    ]
    dropped = ("PYTHONPATH", "PIPROS_MESSAGES", "ROS_LOCALHOST_ONLY")
    kept = {name: value for name, value in without_libraries(variables).items() if name not in dropped}
    if folders:
        kept["PYTHONPATH"] = os.pathsep.join(folders)
    if discovery.range is DiscoveryRange.LOCALHOST and variables.get("ROS_DISTRO") == "humble":
        kept["ROS_LOCALHOST_ONLY"] = "1"  # later distributions deprecate it
    if kept.get("ROS_DISCOVERY_SERVER"):
        kept.setdefault("ROS_SUPER_CLIENT", "TRUE")  # other clients know only what matches their endpoints
    return {**kept, "ROS_AUTOMATIC_DISCOVERY_RANGE": discovery.range.value}


class AgentProcess:
    """Runs the agent. Thread-safe.

    Args:
        python: the interpreter that can import rclpy.
        on_frame: called in one thread for each frame, with its kind, endpoint and body.
        on_end: called once, if the process ends before `close`.

    Attributes:
        rmw: the name of the middleware.
        pid: the number of the process.

    Raises:
        EngineError: the process cannot be started, or rclpy cannot connect.
    """

    def __init__(
        self,
        python: str,
        discovery: Discovery,
        node: str,
        variables: Mapping[str, str],
        on_frame: Callable[[int, int, bytes], None],
        on_end: Callable[[str], None],
    ) -> None:
        settings = json.dumps({"domain": discovery.domain, "node": node})
        self._python = python
        self._argv = [python, os.path.abspath(rclpy_agent.__file__), settings]
        self._variables = agent_environment(discovery, variables)
        self._on_frame = on_frame
        self._on_end = on_end
        self._process: subprocess.Popen[bytes] | None = None
        self._is_started = self._is_closed = False
        self._outbox: deque[Callable[[], Sequence[bytes]]] = deque()
        self._changed = threading.Condition()
        self._started: SimpleQueue[dict[str, Any]] = SimpleQueue()
        # The kernel ends the agent with the thread that has started it.
        self._reader = threading.Thread(target=self._run, name="rclpy", daemon=True)
        self._reader.start()
        try:
            answer = self._started.get(timeout=START_S)
        except Empty:
            answer = {"error": f"it did not start within {START_S:.0f} s"}
        if "error" in answer:
            self.close()
            raise EngineError(_explained(python, answer["error"]))
        self.rmw, self.pid = answer["rmw"], answer["pid"]

    def send(self, kind: Kind, number: int, *parts: bytes) -> None:
        """Send a frame, without waiting."""
        self.send_later(lambda: (HEADER.pack(sum(map(len, parts)), kind, number), *parts))

    def send_later(self, make: Callable[[], Sequence[bytes]]) -> None:
        """Send what a function returns when all earlier frames are sent."""
        with self._changed:
            if not self._is_closed:
                self._outbox.append(make)
                self._changed.notify_all()

    def close(self) -> None:
        """End the process. May be called repeatedly."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        if threading.current_thread() is not self._reader:
            self._reader.join(_END_S)
        if self._process is not None and self._process.poll() is None:
            self._process.kill()

    def _run(self) -> None:
        try:
            self._process = process = subprocess.Popen(  # noqa: S603
                self._argv,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env=self._variables,
                start_new_session=True,  # Ctrl-C is for the gateway, which ends the agent
            )
        except OSError as error:
            self._started.put({"error": error.strerror or str(error)})
            return
        stdin, stdout = cast(BinaryIO, process.stdin), cast(BinaryIO, process.stdout)
        threading.Thread(target=self._write, args=(stdin,), name="to rclpy", daemon=True).start()
        while (frame := read_frame(stdout)) is not None:
            kind, number, body = frame
            if (kind, number) == (Kind.DONE, 0):
                answer = json.loads(body)
                self._is_started = "error" not in answer
                self._started.put(answer)
            else:
                self._on_frame(kind, number, body)
        stdout.close()
        code = process.wait()
        reason = f"the process of rclpy ended with exit code {code}"
        self._started.put({"error": reason})
        if self._is_started and not self._is_closed:
            self._on_end(reason)

    def _write(self, file: BinaryIO) -> None:
        with contextlib.suppress(OSError), file:  # closing the file ends the agent
            while (make := self._next()) is not None:
                file.writelines(make())
                file.flush()

    def _next(self) -> Callable[[], Sequence[bytes]] | None:
        with self._changed:
            self._changed.wait_for(lambda: self._outbox or self._is_closed)
            return self._outbox.popleft() if self._outbox else None


def _explained(python: str, error: str) -> str:
    if "No module named 'rclpy'" in error:
        return f"[{python}] has no rclpy: name the Python of a ROS 2 environment with --ros2-python"
    if "security libraries" in error:
        return (
            f"the Fast DDS of [{python}] has no DDS Security (SROS 2), like the wheels on PyPI: "
            "use an installation of ROS 2, or unset ROS_SECURITY_ENABLE"
        )
    return f"rclpy of [{python}] failed: {' '.join(error.split())}"
