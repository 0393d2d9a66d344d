"""Leave out of pytest's collection the Python files that a collected launch file runs as test programs.

Such a program is often called `test_*.py`, so pytest would collect it, too, and run it without the master and
the nodes of the launch file.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pipros_workspace.index import PackageIndex

# Without launch files, pytest imports only this module and the plugin; see `pytest_plugin`.


class TestPrograms:
    """The test programs of the launch files that a pytest run collects.

    Attributes:
        left_out: the collected programs that pytest leaves out, each with a launch file that runs it.
    """

    __test__ = False  # pytest must not collect this class

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._programs: dict[Path, Path] | None = None
        self._named: set[Path] = set()
        self.left_out: dict[Path, Path] = {}

    def leaves_out(self, file: Path) -> bool:
        """Return whether a collected launch file runs `file` as a test program.

        A file that the command line names is left out only if it also names the launch file, as a pattern of
        the shell does.
        """
        if self._programs is None:
            self._programs = self._find()
        real = file.resolve()
        launch_file = self._programs.get(real)
        if launch_file is None or (real in self._named and launch_file not in self._named):
            return False
        self.left_out[file] = launch_file
        return True

    def report(self) -> list[str]:
        """Return a line for each program that was left out."""
        start = self._config.invocation_params.dir
        return [
            f"not collected: {os.path.relpath(file, start)}, run by {os.path.relpath(runs_it, start)}"
            for file, runs_it in self.left_out.items()
        ]

    def _find(self) -> dict[Path, Path]:
        """Return the launch file of each program. A launch file that the command line names takes precedence.

        Pytest collects files in the order of their names, and importing a program may run it. Therefore, all
        launch files are read before the first program is imported.
        """
        programs: dict[Path, Path] = {}
        launch_files = list(self._launch_files())
        if not launch_files:
            return programs
        from pipros_workspace.index import PackageIndex

        index = PackageIndex.from_environment()
        for launch_file in launch_files:
            for program in self._programs_of(launch_file, index):
                if launch_file in self._named or program not in programs:
                    programs[program] = launch_file
        return programs

    def _launch_files(self) -> Iterator[Path]:
        for word in self._config.args:
            start = Path(self._config.invocation_params.dir, word.partition("::")[0]).resolve()
            if start.is_file():
                self._named.add(start)
                files: Iterable[Path] = [start]
            else:
                files = self._files_below(start)
            yield from filter(has_tests, files)

    def _files_below(self, start: Path) -> Iterator[Path]:
        for name, folders, files in os.walk(start):
            folder = Path(name)
            folders[:] = [each for each in folders if not self._is_ignored(folder / each)]
            yield from (folder / each for each in files if not self._is_ignored(folder / each))

    def _is_ignored(self, path: Path) -> bool:
        if path.is_file() and path.suffix not in (".test", ".launch"):
            return True
        return bool(self._config.hook.pytest_ignore_collect(collection_path=path, config=self._config))

    def _programs_of(self, launch_file: Path, index: PackageIndex) -> Iterator[Path]:
        from pipros.basics.errors import NotFound, PiprosError
        from pipros_tools.testing.pytest_items import read_launch_file
        from pipros_workspace.executables import find_executables, package_of_programs

        try:
            launch = read_launch_file(launch_file, self._config, index)
        except PiprosError:
            return  # the collection of the launch file reports the error
        for test in launch.tests:
            try:
                found = find_executables(package_of_programs(index, test.node.package), test.node.type)
            except NotFound:
                continue  # running the test reports the error
            # A file that is not executable is the program, too: running the test reports the error.
            yield from (path.resolve() for path in (*found.runnable, *found.unusable) if path.is_file())


class LeftOutFile(pytest.File):
    """A program that pytest does not run, because a launch file runs it."""

    def collect(self) -> Iterator[pytest.Item]:
        return iter(())


def has_tests(file: Path) -> bool:
    """Return whether a file is a launch file that may contain tests."""
    if file.suffix not in (".test", ".launch"):
        return False
    from pipros.basics.input_file import read_file

    content = read_file(file)
    # A `.test` file's tests may be in included files. Other programs also use the suffix `.test`.
    return b"<launch" in content and (file.suffix == ".test" or b"<test" in content)
