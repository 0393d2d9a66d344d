"""A process in a launch: started in its own process group, watched, and stopped step by step."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING

from pipros.basics import one_thread
from pipros.basics.input_file import open_file
from pipros.basics.log_file import open_to_write, warn_unwritable
from pipros.basics.posix import NEW_GROUP, interrupt, signal_group
from pipros.basics.warn_once import warn_once
from pipros.basics.windows import ON_WINDOWS, check_working_folder
from pipros_tools.launch.command import CannotLaunch, CannotStart, NodeCommand
from pipros_tools.launch.guardian import SIGKILL, Guardian
from pipros_tools.launch.output_prefix import PrefixedOutput
from pipros_workspace.program_start import has_windows_line_ends, is_left_to_env, why_not_startable

if TYPE_CHECKING:
    from pipros.basics.windows_job import Job

SIGINT, SIGTERM = signal.SIGINT, signal.SIGTERM
_LOOK_EVERY_S = 0.05


class NodeProcess:
    """A started process. A thread waits for it to exit and then calls `on_exit`.

    Attributes:
        name: the process's name in messages, such as `talker-2`.
        popen: the process itself, for inspection by scripts. Only `NodeProcess` may wait for it.
        pid: the process id, which is also the id of the process group.
    """

    def __init__(
        self,
        name: str,
        command: NodeCommand,
        *,
        stdout_log: Path | None,
        stderr_log: Path | None = None,
        guardian: Guardian,
        on_exit: Callable[[NodeProcess], None],
        restarts: bool = False,
        colour: int | None = None,
    ) -> None:
        """Start the process.

        Args:
            stdout_log, stderr_log: files for standard output and standard error; None to inherit the
                launcher's.
            restarts: whether a node is being restarted; if so, its output is appended to the files.
            colour: number of the colour for the name that prefixes each output line on the terminal; None to
                let the process write directly to the terminal.

        Raises:
            CannotLaunch, CannotStart: the operating system refuses to start the process; the error says what
                to try.
        """
        self.name = name
        self.command = command
        self.stdout_log = stdout_log
        self.stderr_log = stderr_log
        self._guardian = guardian
        self._on_exit = on_exit
        self._exited = threading.Event()
        self._prefixed = None if colour is None else PrefixedOutput(name, colour)
        self.popen = _start(command, (stdout_log, stderr_log), self._prefixed, is_again=restarts)
        self.pid = self.popen.pid
        self._job: Job | None = None
        if ON_WINDOWS:
            from pipros.basics.windows_job import Job

            with suppress(OSError):  # it may have exited
                self._job = Job(self.pid)
        self._has_group = True
        guardian.started(self.pid)
        one_thread.start_work(self._wait, self._look, name=f"wait for {name}")

    @property
    def exit_code(self) -> int | None:
        """The exit code, negative if a signal killed the process; None while it is running."""
        return self.popen.returncode if self._exited.is_set() else None

    @property
    def recent_output(self) -> bytes:
        """The end of the output, if the launcher prints it with prefixes; otherwise empty."""
        return b"" if self._prefixed is None else self._prefixed.recent

    @property
    def has_group(self) -> bool:
        """Whether the process, or a process that it started in its group, is still running."""
        if not self._has_group or ON_WINDOWS:
            return not self._exited.is_set() or (self._job is not None and self._job.is_running())
        return _is_group_alive(self.pid)

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal to the process and its group; do nothing if they have exited."""
        if not self._has_group:
            return
        with suppress(OSError):
            if ON_WINDOWS and number is SIGINT:
                interrupt(self.popen)
            elif ON_WINDOWS:
                (self.popen.terminate if self._job is None else self._job.end)()
            else:
                signal_group(self.pid, number)

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait up to `timeout_s` for the process to exit; return False on timeout."""
        return self._exited.wait(timeout_s)

    def release(self) -> None:
        """Kill all processes that remain in the group after the process has exited, and forget the group."""
        if self._has_group and self._exited.is_set():
            self.send_signal(SIGKILL)
            self._forget_group()

    def _look(self) -> float | None:
        """Without a thread: handle the exit, or return when to look again."""
        if self.popen.poll() is None:
            return _LOOK_EVERY_S
        self._wait()
        return None

    def _wait(self) -> None:
        self.popen.wait()
        if self._prefixed is not None:
            self._prefixed.finish()
        self._exited.set()
        # A group that still has a process stays guarded, because a script may have started the real node in
        # the background. Until that process exits, the system does not reuse the group's number.
        if not self.has_group:
            self._forget_group()
        self._on_exit(self)

    def _forget_group(self) -> None:
        self._has_group = False
        if self._job is not None:
            self._job.close()
        self._guardian.ended(self.pid)


def _start(
    command: NodeCommand,
    logs: tuple[Path | None, Path | None],
    prefixed: PrefixedOutput | None,
    *,
    is_again: bool,
) -> subprocess.Popen[bytes]:
    sys.stdout.flush()
    ours = None if prefixed is None else prefixed.write_end
    try:
        _check_first_line(command)
        with ExitStack() as files:
            opened = [None if log is None else _opened(log, append=is_again) for log in logs]
            stdout, stderr = [ours if file is None else files.enter_context(file) for file in opened]
            return subprocess.Popen(  # noqa: S603
                command.argv,
                env=dict(command.environment),
                cwd=_working_folder(command.folder),
                stdout=stdout,
                stderr=stderr,
                start_new_session=True,
                creationflags=NEW_GROUP,
            )
    except OSError as error:
        what = error.filename or command.argv[0]
        raise CannotStart(f"Unable to launch [{' '.join(command.argv)}]: {what}: {error.strerror}") from None
    finally:
        if prefixed is not None:
            prefixed.started()


def _opened(log: Path, *, append: bool) -> IO[bytes] | None:
    """Open a file for a node's output; None, the console instead, if that fails."""
    try:
        return open(open_to_write(log, append=append), "wb")
    except OSError as error:
        warn_unwritable(log, error)
        return None


def _working_folder(folder: Path) -> Path | None:
    """Create the folder in which a node starts; None, the launcher's own folder, if that is impossible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.scandir(folder).close()
    except OSError as error:
        warn_once(
            f"WARNING: nodes start in [{os.getcwd()}], because [{folder}] is unusable: {error.strerror}"
        )
        return None
    check_working_folder(str(folder))
    return folder


def _check_first_line(command: NodeCommand) -> None:
    """Check a script's shebang before starting it, because the operating system's error is unhelpful."""
    program = Path(command.argv[0])
    variables = command.environment
    reason = why_not_startable(program, variables) if program.is_file() else None
    if reason is not None:
        # If the shebang ends in CRLF or names `env`, `env` starts and then fails; only this node is affected.
        is_single = has_windows_line_ends(program) or is_left_to_env(program, variables)
        kind = CannotLaunch if is_single else CannotStart
        raise kind(f"Unable to launch [{' '.join(command.argv)}]: {reason}")


def _is_group_alive(group: int) -> bool:
    """Return whether a process in the group is running.

    Zombies do not count. They stay in the group if the init process does not reap orphans, as in many
    containers.
    """
    try:
        signal_group(group, 0)
    except OSError:
        return False
    numbers = [name for name in os.listdir("/proc") if name.isdigit()] if os.path.isdir("/proc") else []
    if not numbers:
        return True
    for number in numbers:
        with suppress(OSError, ValueError, IndexError):
            with open(f"/proc/{number}/stat", encoding="utf-8", errors="replace") as file:
                state, _, member_of = file.read().rpartition(")")[2].split()[:3]
            if int(member_of) == group and state not in "ZX":
                return True
    return False


def last_lines(file: Path, count: int = 5, limit_bytes: int = 4096) -> list[str]:
    """Return the last `count` non-blank lines among the last `limit_bytes` of a log file."""
    try:
        with open_file(file) as log:
            log.seek(0, os.SEEK_END)
            log.seek(max(0, log.tell() - limit_bytes))
            tail = log.read().decode("utf-8", "replace")
    except OSError:
        return []
    return [line for line in tail.splitlines() if line.strip()][-count:]
