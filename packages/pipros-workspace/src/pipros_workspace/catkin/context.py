"""The state that the commands in a `CMakeLists.txt` share: the project being described, and the variables."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

from pipros.basics.extras import install_command
from pipros.basics.input_file import read_text
from pipros_workspace.catkin.names import CATKIN_COMMANDS
from pipros_workspace.catkin.project import NativeTarget, Project
from pipros_workspace.cmake.interpreter import Interpreter
from pipros_workspace.cmake.language import CMakeError, Command
from pipros_workspace.cmake.names import BUILTIN_COMMANDS
from pipros_workspace.cmake.scope import Scope


@dataclass(frozen=True, slots=True)
class FoundPackage:
    """A package that `find_package()` finds.

    Attributes:
        version: the version in its manifest; empty if unknown.
        extras: CMake files to execute in packages that find this package.
    """

    version: str = ""
    extras: Sequence[str] = ()


_COMPILES = re.compile(r"^[ \t]*add_(?:executable|library)\s*\(", re.IGNORECASE | re.MULTILINE)

_FORGIVEN = BUILTIN_COMMANDS - {"project"}
"""Commands whose errors are left to CMake in a package with compiled code."""

FindPackage = Callable[[str], FoundPackage | None]
"""Function that returns a package by name, or None if it does not exist."""


class ReadContext:
    """State of a package while its `CMakeLists.txt` is executed.

    Attributes:
        project: the contents read so far.
        version: the version in the package's manifest.
        scope: the current variables.
        components: the packages that `find_package()` has found.
        find_package: finds a package by name.
        has_foreign_packages: whether the file uses packages or CMake modules that may define commands unknown
            to pipros.
        empy_hint: text to append to errors about such commands if an empy template may define them; otherwise
            empty.
    """

    def __init__(
        self,
        project: Project,
        version: str,
        scope: Scope,
        find_package: FindPackage,
        handlers: Mapping[str, Handler],
        check: Handler,
    ) -> None:
        """Store the arguments; `run` executes the file.

        Args:
            handlers: the command handlers by command name in lower case.
            check: called before each command; raises `CMakeError` if the command is unknown.
        """
        self.project = project
        self.version = version
        self.scope = scope
        self.components: set[str] = set()
        self.has_foreign_packages = False
        self.empy_hint = ""
        self.find_package = find_package
        self._interpreter = Interpreter(
            scope,
            {name: partial(handler, self) for name, handler in handlers.items()},
            check=lambda command: check(self, command, []),
            on_unsupported=self.need_cmake,
            include_module=self._include_module,
            commands=CATKIN_COMMANDS,
            targets=project.targets,
            forgives=self._forgives,
        )
        self._forgiven: list[CMakeError] = []

    @property
    def file(self) -> str:
        """The file being executed."""
        return self._interpreter.file

    def run(self) -> None:
        """Execute the project's `CMakeLists.txt`.

        In a package with compiled code, errors in CMake's own commands are ignored, because missing libraries
        and variables that only CMake sets can cause them. CMake itself reports the real errors.

        Raises:
            CMakeError: the file is invalid, or reports an error.
        """
        self._interpreter.run_file(self.project.file)
        if self._forgiven and not any(reason.target for reason in self.project.needs_cmake):
            raise self._forgiven[0]

    def _forgives(self, error: CMakeError) -> bool:
        is_forgiven = error.command.lower() in _FORGIVEN and self._compiles
        if is_forgiven:
            self._forgiven.append(error)
        return is_forgiven

    @cached_property
    def _compiles(self) -> bool:
        files = Path(self.project.folder).rglob("CMakeLists.txt")
        return any(_COMPILES.search(read_text(str(file), errors="replace")) for file in files)

    def error(self, command: Command, reason: str) -> CMakeError:
        """Return an error that names the location of a command in the current file."""
        return self._interpreter.error(command, reason)

    def place(self, command: Command) -> str:
        """Return the file and line of a command in the current file."""
        return f"{self.file}:{command.line}"

    def need_cmake(self, command: Command, what: str) -> None:
        """Record that the package uses a feature that only CMake itself provides."""
        self.need_native_build(command, f"needs {what}, which only CMake itself can execute")

    def need_native_build(self, command: Command, what: str, target: str = "") -> None:
        """Record that genuine catkin must build the package; see `NativeTarget` for the arguments."""
        self.project.needs_cmake.append(NativeTarget(what, self.file, command.line, target))

    def run_extras(self, package: FoundPackage) -> None:
        """Execute the CMake extras of a found package. Empy templates are recorded, not executed."""
        for file in package.extras:
            if file.endswith(".em"):
                self.has_foreign_packages = True
                self.empy_hint = f" in {file}; pipros reads it with empy 3 ({install_command('templates')})"
            else:
                self._interpreter.run_file(file)

    def _include_module(self, name: str) -> None:
        if name not in HARMLESS_MODULES:
            self.has_foreign_packages = True


Handler = Callable[[ReadContext, Command, list[str]], None]
"""Handler for a CMake command, called with the command's arguments as words.

Raises `CMakeError` for errors in the file, `ValueError` for wrong arguments, or `Unsupported` if only CMake
itself can run the command.
"""

HARMLESS_MODULES = frozenset(
    ("CMakeParseArguments", "CTest", "GNUInstallDirs", "CheckCXXCompilerFlag", "CheckCCompilerFlag")
)
"""CMake modules whose commands have no effect in a package without compiled code."""
