"""The launch file loader's access to packages, environment variables, files and commands.

`LoadContext.of_process()` returns the real context; tests pass their own.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections import ChainMap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pipros.basics.errors import NotFound, PiprosError
from pipros.basics.graph_variables import InvalidEnvironment
from pipros.basics.input_file import open_file, read_file
from pipros.basics.interruptible_wait import OnceEvent
from pipros.basics.limits import limit_text, process_limits
from pipros.basics.windows import ON_WINDOWS
from pipros.basics.words import split_words
from pipros.packages.well_known import why_no_command, why_not_here
from pipros_tools.launch.budget import LaunchBudget
from pipros_tools.launch.substitute import FindResource, anonymous_name
from pipros_workspace.index import PackageIndex
from pipros_workspace.overlays import built_workspaces
from pipros_workspace.program_start import program_environment, starter_of

if TYPE_CHECKING:
    import subprocess

_CHUNK_BYTES = 65_536


class CommandFailed(PiprosError, ValueError):
    """The command in a `<param command="…">` could not be run, or failed."""


class NotRun(str):
    """A command of a `<param command="…">` that was not run, in place of its output."""

    __slots__ = ()


class LoadContext(NamedTuple):
    """Access to packages, environment variables, files and commands.

    Attributes:
        read_file: function that returns the bytes of a file; raises OSError.
        run_command: function that returns the output of a command line, or `NotRun`; raises CommandFailed.
    """

    find: FindResource
    environment: Mapping[str, str]
    make_anonymous: Callable[[str], str]
    read_file: Callable[[str], bytes]
    run_command: Callable[[str], str]

    @classmethod
    def of_process(cls, index: PackageIndex | None = None) -> LoadContext:
        """Return the context for this computer, with this process's environment."""
        index = index or PackageIndex.from_environment()

        def find(package: str, path: str) -> str:
            return find_resource(index, package, path)

        variables: Mapping[str, str] = os.environ
        if ON_WINDOWS:  # launch files use $(env HOME), which Windows does not set
            variables = ChainMap(os.environ, {"HOME": os.path.expanduser("~")})
        return cls(find, variables, anonymous_name, _read_file, _run_command)

    def without_commands(self) -> LoadContext:
        """Return a context for programs that only read launch files: it runs none of their commands."""
        return self._replace(run_command=NotRun)

    def within(self, budget: LaunchBudget) -> LoadContext:
        """Return a context whose functions raise OverBudget if they read more than `budget` allows."""

        def read(path: str) -> bytes:
            content = self.read_file(path)
            budget.add_bytes(len(content))
            return content

        def run(command: str) -> str:
            output = self.run_command(command)
            budget.add_bytes(len(output))
            return output

        return self._replace(read_file=read, run_command=run)


def find_resource(index: PackageIndex, package: str, path: str) -> str:
    """Return the path to which `$(find package)/path` resolves.

    This is a built program of the package, if one has this path, or else the path in the package's folder.

    Raises:
        NotFound: the package is unknown.
    """
    if package not in index and (reason := why_not_here(package)):
        raise NotFound(f"package [{package}] not found. {reason}")
    folder = index.find(package).path
    if not path:
        return str(folder)
    for workspace in built_workspaces():
        built = workspace.executables_of(package) / path
        if built.exists():
            return str(built)
    return os.path.join(folder, path)


def _read_file(path: str) -> bytes:
    return read_file(path)


def _run_command(command_line: str) -> str:
    """Run a command line without a shell and return its output."""
    import subprocess

    command = split_words(command_line)
    if not command:
        raise CommandFailed("the command is empty")
    if os.path.basename(command[0]) in ("xacro", "xacro.py"):
        _check_files(command)
    encoding = {"PYTHONIOENCODING": "utf-8"} if ON_WINDOWS else {}  # instead of the code page
    environment = program_environment({**encoding, **os.environ})  # run xacro with pipros's Python
    try:
        starter = starter_of(Path(command[0]), environment) if os.sep in command[0] else ()
        words = [*starter, *command]
        with subprocess.Popen(words, bufsize=0, stdout=subprocess.PIPE, env=environment) as process:  # noqa: S603
            printed = _read_output(process, command)
    except InvalidEnvironment as error:
        raise CommandFailed(f"{error} [{command}]") from None
    except OSError as error:
        reason = "no such command" if isinstance(error, FileNotFoundError) else str(error)
        folder, name = os.path.split(command[0])
        why = why_not_here(os.path.basename(folder), (), name) if folder else why_no_command(name)
        text = f"{reason} [{command}]. {why or ''}"
        raise CommandFailed(text.rstrip(". ")) from None
    if process.returncode != 0:
        raise CommandFailed(f"command [{command}] returned with code [{process.returncode}]")
    try:
        return printed.decode()
    except UnicodeDecodeError as error:
        raise CommandFailed(f"command [{command}] printed bytes that are not UTF-8: {error}") from None


def _check_files(command: list[str]) -> None:
    """Raise CommandFailed if an argument is a pipe, a folder or a device, for which xacro could wait."""
    for word in filter(os.path.exists, command[1:]):
        try:
            open_file(word).close()
        except OSError as error:
            raise CommandFailed(f"cannot read [{word}]: {error.strerror} [{command}]") from None


def _read_output(process: subprocess.Popen[bytes], command: list[str]) -> bytes:
    """Return a command's output. Kill the command if it exceeds a limit or Ctrl-C interrupts the wait.

    A thread reads, because a process that the command has started may keep the pipe open.
    """
    limits, printed, has_ended = process_limits(), bytearray(), OnceEvent()
    output: Any = process.stdout

    def read() -> None:
        with contextlib.suppress(OSError, ValueError):  # ValueError: the pipe is closed after the time limit
            while len(printed) <= limits.file_bytes and (chunk := output.read(_CHUNK_BYTES)):
                printed.extend(chunk)
        if len(printed) <= limits.file_bytes:
            process.wait()
        has_ended.set()

    threading.Thread(target=read, daemon=True).start()
    try:
        if not has_ended.wait(limits.launch_command_s):
            limit = limit_text("launch_command_s", limits.launch_command_s)
            advice = "run it in a terminal to see what it waits for"
            raise CommandFailed(
                f"command [{command}] did not end in time, so it was ended: {limit}; {advice}"
            )
        if len(printed) > limits.file_bytes:
            raise CommandFailed(f"command [{command}] printed more than {limits.file_bytes} bytes")
    except BaseException:
        process.kill()
        raise
    return bytes(printed)
