"""Run programs with a time limit, and end them if the process that started them ends for any reason.

`LimitedProcess` runs this module as a small process between itself and the program. That process sends SIGINT
to the program when the time limit has passed or its own standard input ends, and kills the program if it does
not end.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import ENDING_SIGNALS
from pipros.basics.posix import NEW_GROUP, interrupt

ENDING_S: Final = 20.0
"""Maximum time (s) for the program to end after SIGINT."""
OUTPUT_BYTES: Final = 8192
"""Number of bytes that are kept from the end of the output."""


class LimitedProcess:
    """A running program. Thread-safe."""

    def __init__(self, command: Sequence[str], limit_s: float, environment: Mapping[str, str]) -> None:
        """Start the program.

        Raises:
            OSError: no process can be started.
        """
        self._output = b""
        # In a new session, so that Ctrl-C in the terminal of this process does not reach the program.
        self._process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-I", "-m", "pipros_server.limited_process", str(limit_s), *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=dict(environment),
            start_new_session=True,
            creationflags=NEW_GROUP,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def is_running(self) -> bool:
        return self._process.poll() is None

    @property
    def output(self) -> str:
        """The end of the program's output so far."""
        return self._output.decode("utf-8", "replace")

    def stop(self, wait_s: float = 0.0) -> bool:
        """End the program, and wait up to `wait_s`. Return whether it has ended."""
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(wait_s)
        return not self.is_running

    def _read(self) -> None:
        output = self._process.stdout
        if output is None:
            return
        with contextlib.suppress(OSError, ValueError), output:
            while chunk := os.read(output.fileno(), 4096):
                self._output = (self._output + chunk)[-OUTPUT_BYTES:]
        self._process.wait()


class LimitedProcesses:
    """The programs that one server has started, by number. Thread-safe."""

    def __init__(self, limit: int) -> None:
        """Create an empty set. At most `limit` programs run at a time."""
        self._limit = limit
        self._found: dict[int, tuple[str, LimitedProcess]] = {}
        self._started = 0
        self._lock = threading.Lock()

    def start(self, name: str, command: Sequence[str], limit_s: float, environment: Mapping[str, str]) -> int:
        """Start a program, and return its number. Forget the programs that have ended.

        Raises:
            PiprosError: too many programs run.
            OSError: no process can be started.
        """
        with self._lock:
            self._found = {number: each for number, each in self._found.items() if each[1].is_running}
            if len(self._found) >= self._limit:
                raise PiprosError(f"{len(self._found)} programs already run; stop one of them first")
            process = LimitedProcess(command, limit_s, environment)
            self._started += 1
            self._found[self._started] = (name, process)
            return self._started

    def get(self, number: int) -> LimitedProcess | None:
        """Return the program with this number, or None if `start` has forgotten it or never returned it."""
        with self._lock:
            return self._found.get(number, ("", None))[1]

    def rows(self) -> list[Mapping[str, Any]]:
        """Return the programs with the end of their output."""
        with self._lock:
            found = list(self._found.items())
        return [
            {"run": number, "name": name, "is_running": each.is_running, "output": each.output}
            for number, (name, each) in found
        ]

    def stop(self) -> None:
        """End all programs. Does not wait."""
        with self._lock:
            for _, each in self._found.values():
                each.stop()


def main(arguments: Sequence[str]) -> int:
    """Run the command `arguments[1:]` for at most `arguments[0]` seconds. Return its exit code."""
    limit_s, *command = arguments
    program = subprocess.Popen(  # noqa: S603
        command, stdin=subprocess.DEVNULL, start_new_session=True, creationflags=NEW_GROUP
    )
    over = threading.Event()

    def wait_for_end_of_input() -> None:
        with contextlib.suppress(OSError):
            while os.read(0, 4096):
                pass
        over.set()

    def wait_for_end_of_program() -> None:
        program.wait()
        over.set()

    for number in ENDING_SIGNALS:
        signal.signal(number, lambda *_: over.set())
    for target in (wait_for_end_of_input, wait_for_end_of_program):
        threading.Thread(target=target, daemon=True).start()
    over.wait(float(limit_s))
    with contextlib.suppress(OSError):
        interrupt(program)
    with contextlib.suppress(subprocess.TimeoutExpired):
        program.wait(ENDING_S)
    if program.poll() is None:
        program.kill()
    return program.returncode or 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
