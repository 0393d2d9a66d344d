"""Processes that a test starts: live output, Ctrl-C, and a check that none is still running at the end."""

import contextlib
import os
import re
import select
import signal
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO

from tests.support.started import STARTED
from tests.support.waiting import wait_until

_VARIABLE = "PIPROS_TEST_RUN"
_INTERRUPTED = re.compile(r"(?ms)^(?:Fatal Python error|Traceback) .*?^KeyboardInterrupt$")
_GRACE_S = 15.0
_DESCENDANT_S = 2.0
"""How long to wait, after a program has ended, for a descendant that keeps its output open."""
_LIMIT_S = 30.0
"""Time limit for steps that take only moments unless the machine is busy."""

INTERRUPTED = 1 if sys.version_info < (3, 14) else -signal.SIGINT
"""The exit code of a script that an exception of rospy ended after Ctrl-C.

This exception is derived from KeyboardInterrupt. Since Python 3.14, such exceptions end the process by
SIGINT.
"""


class Process:
    """A running program in its own session. Its output is read continuously, so output never blocks it.

    Attributes:
        stdout, stderr: the lines printed so far, without line ends.
        lines: the lines of both, in the order of arrival.
    """

    def __init__(
        self, argv: Sequence[str], environment: Mapping[str, str], cwd: Path | None, stdin: int
    ) -> None:
        self.argv = [str(part) for part in argv]
        self.stdout: list[str] = []
        self.stderr: list[str] = []
        self.lines: list[str] = []
        self._printed_at: list[str] = []
        self._changed = threading.Condition()
        self._popen = subprocess.Popen(
            self.argv, env=dict(environment), cwd=cwd, stdin=stdin, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, start_new_session=True, text=True, encoding="utf-8", errors="replace",
        )  # fmt: skip
        self._readers = [
            threading.Thread(target=self._read, args=(stream, lines), daemon=True)
            for stream, lines in ((self._popen.stdout, self.stdout), (self._popen.stderr, self.stderr))
        ]
        for reader in self._readers:
            reader.start()
        STARTED.add(self)

    def _read(self, stream: IO[str], lines: list[str]) -> None:
        with contextlib.closing(stream):
            for line in stream:
                with self._changed:
                    lines.append(line.rstrip("\n"))
                    self.lines.append(line.rstrip("\n"))
                    self._printed_at.append(STARTED.elapsed())
                    self._changed.notify_all()

    @property
    def pid(self) -> int:
        return self._popen.pid

    @property
    def is_running(self) -> bool:
        return self._popen.poll() is None

    @property
    def returncode(self) -> int | None:
        return self._popen.poll()

    @property
    def output(self) -> str:
        """The output so far."""
        return "\n".join(self.lines)

    @property
    def transcript(self) -> list[str]:
        """The output so far, with the time of each line, and the exit code."""
        lines = [f"{at} {line}" for at, line in zip(self._printed_at, self.lines, strict=False)]
        return lines if self.is_running else [*lines, f"(exit code {self.returncode})"]

    def mark(self) -> int:
        """Return the current position in the output, for `wait_for(..., since=mark)`."""
        return len(self.lines)

    def wait_for(self, pattern: str, timeout_s: float = 60.0, since: int = 0) -> re.Match[str]:
        """Wait for a line in which the regular expression `pattern` is found. Return the match.

        Args:
            since: the position in the output at which to start; see `mark`.

        Raises:
            AssertionError: the program ended, or the time limit expired, without such a line. The message
                contains the whole output.
        """
        looked_for = re.compile(pattern)
        deadline = time.monotonic() + timeout_s
        seen = since
        with self._changed:
            while True:
                for line in self.lines[seen:]:
                    if found := looked_for.search(line):
                        return found
                seen = len(self.lines)
                if not any(reader.is_alive() for reader in self._readers):
                    raise AssertionError(f"{self} ended without the line /{pattern}/:\n{self.output}")
                if time.monotonic() >= deadline:
                    raise AssertionError(f"{self}: no line /{pattern}/ in {timeout_s} s:\n{self.output}")
                self._changed.wait(0.1)

    def write_line(self, text: str) -> None:
        """Write a line to the program's standard input, which must be a pipe."""
        assert self._popen.stdin is not None
        self._popen.stdin.write(text + "\n")
        self._popen.stdin.flush()

    def end_input(self) -> None:
        """Close the program's standard input, which must be a pipe."""
        assert self._popen.stdin is not None
        self._popen.stdin.close()

    def press_ctrl_c(self, *, code: int | None = None) -> None:
        """Send SIGINT to the program's process group, as a terminal does. Wait for an exit code, if given."""
        self._signal_group(signal.SIGINT)
        assert code is None or self.wait() == code, self.output

    def send_signal(self, number: int, *, code: int | None = None) -> None:
        """Send a signal to this process only. Wait for an exit code, if given."""
        self._popen.send_signal(number)
        assert code is None or self.wait() == code, self.output

    def kill(self) -> None:
        self._popen.kill()

    def wait(self, timeout_s: float = 60.0) -> int:
        """Wait until the program has exited and its output is read; return the exit code.

        Raises:
            AssertionError: it is still running after `timeout_s`. The message contains the whole output.
        """
        try:
            code = self._popen.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self} still runs after {timeout_s} s:\n{self.output}") from None
        for reader, stream in zip(self._readers, (self._popen.stdout, self._popen.stderr), strict=True):
            assert stream is not None
            deadline = time.monotonic() + _LIMIT_S
            reader.join(_DESCENDANT_S)
            while reader.is_alive() and _has_more(stream) and time.monotonic() < deadline:
                reader.join(0.1)  # the machine is busy
        return code

    def check(self, code: int, *texts: str) -> None:
        """Wait for the end: the program exits with `code`, and has printed each text, and no traceback.

        rostest may interrupt a node while Python starts or imports rospy, and Python then prints a traceback.
        """
        assert self.wait() == code, self.output
        missing = [text for text in texts if text not in self.output]
        assert not missing, f"{self} lacks {missing}:\n{self.output}"
        output = _INTERRUPTED.sub("", self.output) if "rostest" in " ".join(self.argv) else self.output
        assert "Traceback" not in output, self.output

    def end(self) -> None:
        """If the program is still running, press Ctrl-C, and after a while, kill its process group."""
        self._signal_group(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._popen.wait(_GRACE_S)
        if self.is_running:
            self._signal_group(signal.SIGKILL)
            self._popen.wait(_LIMIT_S)
        for reader in self._readers:
            reader.join(1.0)
        if self._popen.stdin is not None:
            self._popen.stdin.close()

    def _signal_group(self, number: int) -> None:
        if self.is_running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.pid, number)

    def __str__(self) -> str:
        return " ".join(self.argv)


def _has_more(stream: IO[str]) -> bool:
    """Return whether a stream has output, or has ended, and its reader has not noticed yet."""
    try:
        return bool(select.select([stream], [], [], 0)[0])
    except ValueError:  # its reader has closed it, and is about to end
        return True


class Processes:
    """Starts programs in one environment. A token in the environment identifies all their descendants."""

    def __init__(self, environment: Mapping[str, str], cwd: Path | None = None) -> None:
        self._token = f"{_VARIABLE}={uuid.uuid4()}"
        name, _, value = self._token.partition("=")
        self.environment = {**environment, name: value}
        self.cwd = cwd
        self._started: list[Process] = []

    def start(
        self,
        *argv: str | Path,
        cwd: Path | None = None,
        stdin: int = subprocess.DEVNULL,
        environment: Mapping[str, str] | None = None,
    ) -> Process:
        """Start a program. `environment` is merged into the common environment."""
        process = Process(
            [str(part) for part in argv], {**self.environment, **(environment or {})}, cwd or self.cwd, stdin
        )
        self._started.append(process)
        return process

    def run(
        self,
        *argv: str | Path,
        timeout_s: float = 60.0,
        cwd: Path | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> Process:
        """Run a program to its end. The result has `returncode`, `stdout`, `stderr` and `output`."""
        process = self.start(*argv, cwd=cwd, environment=environment)
        process.wait(timeout_s)
        return process

    def left(self) -> list[str]:
        """Return `pid: command line` of every running process with the token, including orphans."""
        return [f"{pid}: {command}" for pid, command in self._find_left()]

    def _find_left(self) -> list[tuple[int, str]]:
        token = self._token.encode()
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if token in (folder / "environ").read_bytes().split(b"\0"):
                    command = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                    found.append((int(folder.name), command.strip()))
        return found

    def assert_nothing_left(self, timeout_s: float = 15.0) -> None:
        """Wait until no process with the token is running.

        Raises:
            AssertionError: processes were still running after `timeout_s`; they were killed.
        """
        try:
            wait_until(lambda: not self._find_left(), timeout_s)
        except AssertionError:
            left = self._find_left()
            for pid, _ in left:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            if left:
                listing = "\n".join(f"{pid}: {command}" for pid, command in left)
                raise AssertionError(f"left running:\n{listing}") from None

    def end_all(self) -> None:
        """End the started programs, the latest first, and check that none of their descendants is left."""
        for process in reversed(self._started):
            process.end()
        self.assert_nothing_left()
