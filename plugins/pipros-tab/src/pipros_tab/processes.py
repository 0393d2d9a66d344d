"""A replacement for `subprocess.Popen`, which starts Python programs and commands in further workers."""

from __future__ import annotations

import _thread
import builtins
import io
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import IO, Any, ClassVar, Final, NoReturn

from pipros_tab.files import SharedFiles
from pipros_tab.network import Network
from pipros_tab.packets import NUMBER, PacketKind
from pipros_tab.sockets import KEYBOARD
from pipros_tab.tab_socket import NO_LINES
from pipros_tab.turns import WorkerTurns

ONLY_PYTHON: Final = "a browser tab runs only Python programs and pipros's commands"

_Output = IO[Any] | int | None


class TabProcess:
    """A program in another worker. Only what pipros uses of `subprocess.Popen` exists.

    Attributes:
        pid: the number of the process in the tab.
    """

    network: ClassVar[Network]
    turns: ClassVar[WorkerTurns]
    files: ClassVar[SharedFiles]
    filters: ClassVar[Sequence[Sequence[str]]] = ()

    def __init__(
        self,
        args: Sequence[str | os.PathLike[str]],
        *,
        env: Mapping[str, str] | None = None,
        cwd: str | os.PathLike[str] | None = None,
        stdin: _Output = None,
        stdout: _Output = None,
        stderr: _Output = None,
        filters: Sequence[Sequence[str]] = (),
        **_: object,
    ) -> None:
        """Start a program. Its output passes through the filters, by default those of this program.

        Raises:
            OSError: it would need a pipe or a shell, which a tab lacks.
        """
        if isinstance(args, str):
            raise OSError(f"{ONLY_PYTHON}, without a shell: {args}")
        self.args = [os.fspath(each) for each in args]
        pipes = (subprocess.PIPE, subprocess.STDOUT)
        if stdout in pipes or stderr in pipes or stdin == subprocess.PIPE:
            raise OSError(f"{ONLY_PYTHON}, without pipes: {' '.join(self.args)}")
        self.files.push()
        self.pid = self.network.start(
            {
                "argv": self.args,
                "environment": dict(os.environ if env is None else env),
                "folder": os.fspath(cwd) if cwd is not None else os.getcwd(),
                "stdout": _path_of(stdout),
                "stderr": _path_of(stderr),
                "filters": filters or (self.filters if stdout is None else ()),
            }
        )

    @property
    def returncode(self) -> int | None:
        return self.network.codes.get(self.pid)

    def poll(self) -> int | None:
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end, and return the exit code.

        Raises:
            subprocess.TimeoutExpired: the timeout expired first.
        """
        self.turns.wait(lambda: self.returncode is not None, timeout)
        code = self.returncode
        if code is None:
            raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
        return code

    def communicate(self, _: object = None, timeout: float | None = None) -> tuple[None, None]:
        """Wait for the end."""
        self.wait(timeout)
        return None, None

    def send_signal(self, number: int) -> None:
        """Send a signal; do nothing if the process has ended."""
        if self.returncode is None:
            self.network.send(PacketKind.SIGNAL, self.pid, NUMBER.pack(number))

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(9)

    def __enter__(self) -> TabProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.wait()


def _path_of(output: _Output) -> str | None:
    """Return the path of an open file, or None for the terminal."""
    if output is None:
        return None
    number = output if isinstance(output, int) else output.fileno()
    return os.devnull if number < 0 else os.readlink(f"/proc/self/fd/{number}")


def _signal_process(process: int, number: int) -> None:
    """Replace `os.killpg`: a process of a tab is a group."""
    network = TabProcess.network
    if process in network.codes:
        raise ProcessLookupError(f"there is no process {process}")
    if number:
        network.send(PacketKind.SIGNAL, process, NUMBER.pack(number))


def _no_thread(*_: object, **__: object) -> None:
    raise RuntimeError("a browser tab has no threads: use rospy.Timer, or a loop with rospy.sleep")


def _no_program(*_: object, **__: object) -> None:
    raise OSError(ONLY_PYTHON)


def _no_lines(*_: object) -> NoReturn:
    raise OSError(NO_LINES)


class _Keys(io.TextIOBase):
    """The standard input: that of a terminal, so that no command waits for text from another program."""

    read = readline = _no_lines

    def fileno(self) -> int:
        return KEYBOARD

    def isatty(self) -> bool:
        return True


def install(network: Network, turns: WorkerTurns, files: SharedFiles, threads: Any) -> None:
    """Replace Python's processes. Threads cannot be started: each call raises one clear error.

    Args:
        threads: the class whose `start` is replaced, `threading.Thread`.
    """
    TabProcess.network, TabProcess.turns, TabProcess.files = network, turns, files
    replace: Callable[..., None] = setattr
    replace(subprocess, "Popen", TabProcess)
    replace(os, "killpg", _signal_process)
    replace(threads, "start", _no_thread)
    replace(_thread, "start_new_thread", _no_thread)
    replace(builtins, "input", _no_lines)
    replace(sys, "stdin", _Keys())
    for name in ("execv", "fork", "popen", "posix_spawn", "spawnv", "spawnve", "system"):
        replace(os, name, _no_program)
