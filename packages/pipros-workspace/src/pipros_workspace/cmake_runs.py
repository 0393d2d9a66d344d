"""Run CMake and make on several packages at once, and find out which of them fail.

All packages share one build folder, as in genuine catkin_make. CMake stops at the first package that it
cannot configure; its output names this package. If a target fails, make continues with the other targets.
If any target failed, make is then run for each package, to determine whether the package is complete.
"""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_file
from pipros.basics.terminals import HAS_PTYS, open_pty

_PROCESSING = re.compile(r"-- \+\+\+ processing catkin (?:meta)?package: '(.+)'")
_ERROR = re.compile(r"CMake Error (?:at|in) (.+?)(?::\d+)?(?: \(\w+\))?:")
_TARGET_ERROR = re.compile(r"(?:CMake Error: .*|\s+linked by )\btarget:? \"?([^\s\".]+)")
"""An error that names no file but a target, such as a program that has no language or lacks a library."""

_DONE = "-- Configuring done"
_REASON_LINES = 4
_COMPILER_ERROR = re.compile(r".*(?:\berror:|undefined reference|\bError \d+).*")


class NativeBuildFailed(PiprosError):
    """CMake or make failed. Their output precedes this error in the terminal."""


def configure(
    command: Sequence[str], folder: Path, variables: Mapping[str, str], packages: Mapping[str, Path]
) -> dict[str, str]:
    """Run CMake, and return the packages that it rejects, each with the reason.

    The output is copied to this process's standard output, line by line. Blocks until CMake exits.

    Args:
        packages: the folders of the packages, by name.

    Raises:
        NativeBuildFailed: CMake failed, but its output names no package as the cause.
    """
    output = _ConfigureOutput(packages)

    def read(line: str) -> None:
        _show(line)
        output.read(line)

    if _ended(command, folder, folder, variables, read) == 0:
        return {}
    if not output.reasons:
        raise NativeBuildFailed(failure_of(command))
    return {name: "\n".join(lines) for name, lines in output.reasons.items()}


class _ConfigureOutput:
    """Parser that finds errors in the lines that CMake prints.

    `reasons` contains the first lines of the first error of each package.
    """

    def __init__(self, packages: Mapping[str, Path]) -> None:
        self.reasons: dict[str, list[str]] = {}
        self._packages = packages
        self._current = ""
        self._lines: list[str] | None = None

    def read(self, line: str) -> None:
        """Process the next line."""
        if found := _PROCESSING.match(line):
            self._current = found[1]
        elif line.startswith(_DONE):
            self._current = ""  # later errors contain the path of the package's file
        elif found := _ERROR.match(line):
            self._start(self._owner(found[1]) or self._current, line)
        elif found := _TARGET_ERROR.match(line):
            self._start(self._owner_of_target(found[1]) or "", line)
        elif self._lines is not None:
            if line.startswith(" ") and len(self._lines) < _REASON_LINES:
                self._lines.append(line)
            else:
                self._lines = None

    def _start(self, name: str, line: str) -> None:
        self._lines = [line] if name in self._packages and name not in self.reasons else None
        if self._lines is not None:
            self.reasons[name] = self._lines

    def _owner_of_target(self, target: str) -> str | None:
        """Return the package whose `CMakeLists.txt` adds a program or a library."""
        added = re.compile(rf"^[ \t]*add_(?:executable|library)\s*\(\s*{re.escape(target)}\s", re.I | re.M)
        for name, folder in self._packages.items():
            try:
                text = read_file(folder / "CMakeLists.txt").decode("utf-8", "replace")
            except OSError:
                continue
            if added.search(text.replace("${PROJECT_NAME}", name)):
                return name
        return None

    def _owner(self, file: str) -> str | None:
        """Return the package that contains a file. A relative path is relative to the source folder."""
        path = Path(file)
        if not path.is_absolute():
            return path.parts[0] if path.parts[0] in self._packages else None
        folders = {folder.resolve(): name for name, folder in self._packages.items()}
        return next((folders[parent] for parent in path.resolve().parents if parent in folders), None)


def make_all(
    jobs: Sequence[str], folder: Path, variables: Mapping[str, str], packages: Sequence[str]
) -> dict[str, str]:
    """Make all packages, and return those that are not complete, each with the reason.

    A target that fails does not stop the others. Blocks until make exits.

    Raises:
        NativeBuildFailed: make failed, but all packages are complete.
    """
    command = ["make", "--keep-going", *jobs]
    if _ended(command, folder, folder, variables) == 0:
        return {}
    failed = {}
    for name in packages:
        lines: list[str] = []
        if _ended(["make", *jobs], folder / name, folder, variables, lines.append) != 0:
            failed[name] = next(filter(_COMPILER_ERROR.match, lines), failure_of(command))
    if not failed:
        raise NativeBuildFailed(failure_of(command))
    return failed


def run(command: Sequence[str], folder: Path, variables: Mapping[str, str]) -> None:
    """Run a command with this process's standard output.

    Raises:
        NativeBuildFailed: the command failed.
    """
    if _ended(command, folder, folder, variables) != 0:
        raise NativeBuildFailed(failure_of(command))


def _show(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _ended(
    command: Sequence[str],
    folder: Path,
    build: Path,
    variables: Mapping[str, str],
    read: Callable[[str], object] = _show,
) -> int:
    """Run a command in a folder, pass each line of its output to `read`, and return its exit code.

    The links to packages beside the build folder are replaced by the folders of the packages, because users
    look for an error in their own file.
    """
    links = f"{build.parent}/src/"

    def own_path(found: re.Match[str]) -> str:
        link = Path(found[0])
        return os.readlink(link) if link.is_symlink() else found[0]

    # On a terminal, tools use colors; what is parsed has none.
    has_colors = HAS_PTYS and read is _show and sys.stdout.isatty()
    ours, theirs = open_pty(sys.stdout.fileno()) if has_colors else os.pipe()
    with (
        os.fdopen(ours, "rb") as output,
        subprocess.Popen(command, cwd=folder, env=dict(variables), stdout=theirs, stderr=theirs) as process,  # noqa: S603
    ):
        os.close(theirs)
        for raw in _lines(output):
            line = raw.decode("utf-8", "replace").rstrip()
            read(re.sub(rf"{re.escape(links)}[^/\s:]+(?=/)", own_path, line) if links in line else line)
    return process.returncode


def _lines(output: Iterable[bytes]) -> Iterator[bytes]:
    with contextlib.suppress(OSError):  # which a pty raises at its end
        yield from output


def failure_of(command: Sequence[str]) -> str:
    """Return the text of the error for a failed command."""
    return f'Invoking "{" ".join(command[:2])}" failed; the reason is printed above'
