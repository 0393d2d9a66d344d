"""What the loader of launch files needs from the computer that it runs on, behind one value.

Tests give their own; `Surroundings.here()` is the real thing.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from pipros.errors import PiprosError
from pipros.launch.substitute import FindResource, anonymous_name
from pipros.workspace.index import PackageIndex
from pipros.workspace.overlays import built_workspaces


class CommandFailed(PiprosError, ValueError):
    """The command of a `<param command="…">` could not be run, or ended with an error."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Packages, environment, files and commands.

    Attributes:
        read_file: the bytes of a file; raises OSError.
        run_command: what a command line prints; raises CommandFailed.
    """

    find: FindResource
    environment: Mapping[str, str]
    make_anonymous: Callable[[str], str]
    read_file: Callable[[str], bytes]
    run_command: Callable[[str], str]

    @classmethod
    def here(cls, index: PackageIndex | None = None) -> Surroundings:
        """This computer, with the environment of this process."""
        index = index or PackageIndex.from_environment()

        def find(package: str, path: str) -> str:
            return find_resource(index, package, path)

        return cls(find, os.environ, anonymous_name, _read_file, _run_command)


def find_resource(index: PackageIndex, package: str, path: str) -> str:
    """The path that `$(find package)/path` means: a built program of that name, else below the package.

    Raises:
        NotFound: for an unknown package.
    """
    folder = index.find(package).path
    if not path:
        return str(folder)
    for workspace in built_workspaces():
        built = workspace.executables_of(package) / path
        if built.exists():
            return str(built)
    return os.path.join(folder, path)


def _read_file(path: str) -> bytes:
    return Path(path).read_bytes()


def _run_command(command_line: str) -> str:
    """Runs a command line without a shell and gives back what it printed."""
    import subprocess

    command = shlex.split(command_line)
    if not command:
        raise CommandFailed("the command is empty")
    try:
        ended = subprocess.run(command, stdout=subprocess.PIPE, check=False)  # noqa: S603
    except OSError as error:
        reason = "no such command" if isinstance(error, FileNotFoundError) else str(error)
        raise CommandFailed(f"{reason} [{command}]") from None
    if ended.returncode != 0:
        raise CommandFailed(f"command [{command}] returned with code [{ended.returncode}]")
    try:
        return ended.stdout.decode()
    except UnicodeDecodeError as error:
        raise CommandFailed(f"command [{command}] printed what is no text: {error}") from None
