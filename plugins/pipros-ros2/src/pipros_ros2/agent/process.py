"""The process of the agent: its environment, its start and end, and the frames to and from it."""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
import threading
from collections.abc import Callable, Mapping
from concurrent import futures
from pathlib import Path
from queue import SimpleQueue
from typing import BinaryIO, Final, cast

from pipros_ros2.agent import rclpy_agent
from pipros_ros2.agent.rclpy_agent import FrameWriter, Kind, read_frame
from pipros_ros2.interface import EngineError
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange
from pipros_workspace.client_library import without_libraries

Frame = tuple[Kind, int, int, bytes]
"""A kind, the number of an endpoint, that of a question or of what is answered, and the body."""
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
    """Runs the agent. Thread-safe. For what is not here, see `RclpyEngine`.

    Args:
        on_frame: called in one thread for each frame that is no answer.
    """

    pid: int

    def __init__(
        self,
        python: str,
        discovery: Discovery,
        node: str,
        variables: Mapping[str, str],
        on_frame: Callable[[int, int, int, bytes], None],
        on_end: Callable[[str], object],
    ) -> None:
        self._argv = python, os.path.abspath(rclpy_agent.__file__), str(discovery.domain), node
        self._variables = agent_environment(discovery, variables)
        self._on_frame = on_frame
        self._on_end = on_end
        self._process: subprocess.Popen[bytes] | None = None
        self._is_closed = False
        self._end_reason = ""
        self._outbox: SimpleQueue[Callable[[], Frame | None] | None] = SimpleQueue()
        self._numbers = itertools.count(1)
        started = futures.Future[bytes]()
        self._asked = {0: started}
        # The kernel ends the agent with the thread that has started it.
        self._reader = threading.Thread(target=self._run, name="rclpy", daemon=True)
        self._reader.start()
        try:
            self.rmw = started.result(START_S).decode()
        except (futures.TimeoutError, EngineError) as error:
            self.close()
            reason = str(error) or f"it did not start within {START_S:.0f} s"
            raise EngineError(_explained(python, reason)) from None

    def send(self, kind: Kind, end: int, number: int = 0, body: bytes = b"") -> None:
        """Send a frame, without waiting."""
        self.send_later(lambda: (kind, end, number, body))

    def send_later(self, make: Callable[[], Frame | None]) -> None:
        """Send the frame that a function returns, if any, when all earlier ones are sent."""
        if not self._is_closed:
            self._outbox.put(make)

    def ask(self, kind: Kind, end: int, body: bytes, timeout_s: float) -> bytes | None:
        """Send a frame, and return the answer, or None if there is none in time.

        Raises:
            EngineError: the process has ended, or the frame was a call that failed.
        """
        number, answer = next(self._numbers), futures.Future[bytes]()
        self._asked[number] = answer
        try:
            self.send(kind, end, number, body)
            if self._end_reason:
                raise EngineError(self._end_reason)
            return answer.result(timeout_s)
        except futures.TimeoutError:
            return None
        finally:
            self._asked.pop(number, None)

    def close(self) -> None:
        """End the process. May be called repeatedly."""
        self._is_closed = True
        self._outbox.put(None)
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
            self._end(error.strerror or str(error))
            return
        self.pid = process.pid
        stdin, stdout = cast(BinaryIO, process.stdin), cast(BinaryIO, process.stdout)
        threading.Thread(target=self._write, args=(stdin,), name="to rclpy", daemon=True).start()
        reason = ""
        while (received := read_frame(stdout)) is not None:
            kind, end, number, body = received
            if kind == Kind.FAILED and not number:
                reason = body.decode()
            elif kind not in (Kind.ANSWER, Kind.FAILED):
                self._on_frame(kind, end, number, body)
            elif (asked := self._asked.pop(number, None)) is not None:
                if kind == Kind.ANSWER:
                    asked.set_result(body)
                else:
                    asked.set_exception(EngineError(body.decode()))
        stdout.close()
        code = process.wait()
        self._end(reason or f"the process of rclpy ended with exit code {code}")

    def _end(self, reason: str) -> None:
        self._end_reason = reason
        is_started = 0 not in self._asked
        for number in list(self._asked):
            if (asked := self._asked.pop(number, None)) is not None:
                asked.set_exception(EngineError(reason))
        if is_started and not self._is_closed:
            self._on_end(reason)

    def _write(self, file: BinaryIO) -> None:
        writer = FrameWriter(file)
        with contextlib.suppress(OSError), file:  # closing the file ends the agent
            while (make := self._outbox.get()) is not None:
                if (made := make()) is not None:
                    writer.send(*made)


def _explained(python: str, error: str) -> str:
    if "No module named 'rclpy'" in error:
        return f"[{python}] has no rclpy: name the Python of a ROS 2 environment with --ros2-python"
    if "security libraries" in error:
        return (
            f"the Fast DDS of [{python}] has no DDS Security (SROS 2), like the wheels on PyPI: "
            "use an installation of ROS 2, or unset ROS_SECURITY_ENABLE"
        )
    return f"rclpy of [{python}] failed: {' '.join(error.split())}"
