"""What the commands of a `CMakeLists.txt` work with: the project that they describe, and the variables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from pipros.basics.input_file import read_text
from pipros.cmake.configure import configured
from pipros.cmake.interpreter import Interpreter
from pipros.cmake.language import CMakeError, Command
from pipros.cmake.scope import Scope
from pipros.workspace.catkin.names import CATKIN_COMMANDS
from pipros.workspace.catkin.project import NativeTarget, Project


@dataclass(frozen=True, slots=True)
class FoundPackage:
    """A package that `find_package()` finds.

    Attributes:
        version: that of its manifest; empty if it is not known.
        extras: the CMake files that it gives to the packages that find it.
    """

    version: str = ""
    extras: Sequence[str] = ()


FindPackage = Callable[[str], FoundPackage | None]
"""Finds a package by name; None if it does not exist."""


class ReadContext:
    """A package while its `CMakeLists.txt` is carried out.

    Attributes:
        project: what was read so far.
        version: that of the package's manifest.
        scope: the current variables.
        components: the packages that `find_package()` has found.
        find_package: finds a package by name.
        has_foreign_packages: whether commands may exist that only CMake itself would find.
        empy_hint: where such commands may be, if that is a template that cannot be expanded.
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
        """Reads nothing yet.

        Args:
            handlers: what commands do, by their names in lower case.
            check: called before each command; raises `CMakeError` if it is unknown.
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
        )

    @property
    def file(self) -> str:
        """The file that is being carried out."""
        return self._interpreter.file

    def run(self) -> None:
        """Carries out the `CMakeLists.txt` of the project. Raises CMakeError."""
        self._interpreter.run_file(self.project.file)

    def error(self, command: Command, reason: str) -> CMakeError:
        """An error at a command of the current file."""
        return self._interpreter.error(command, reason)

    def place(self, command: Command) -> str:
        """File and line of a command of the current file."""
        return f"{self.file}:{command.line}"

    def need_cmake(self, command: Command, what: str) -> None:
        """Records that only CMake itself can do something for the package."""
        self.need_native_build(command, f"needs {what}, which only CMake itself carries out")

    def need_native_build(self, command: Command, what: str) -> None:
        """Records that genuine catkin has to build the package; `what` completes "the package [x] …"."""
        self.project.needs_cmake.append(NativeTarget(what, self.file, command.line))

    def run_extras(self, package: FoundPackage) -> None:
        """Carries out the CMake files that a package gives to those that find it."""
        for file in package.extras:
            if file.endswith(".em"):
                self.has_foreign_packages = True
                self.empy_hint = f" in {file}; pipros reads it with empy 3 (pip install 'pipros[templates]')"
            elif file.endswith(".in"):
                text = configured(read_text(file, errors="replace"), self.scope, at_only=True)
                self._interpreter.run_text(text, file)
            else:
                self._interpreter.run_file(file)

    def _include_module(self, name: str) -> None:
        if name not in HARMLESS_MODULES:
            self.has_foreign_packages = True


Handler = Callable[[ReadContext, Command, list[str]], None]
"""What a command does for a package; called with its arguments as words.

Raises CMakeError, or ValueError for wrong arguments, or `Unsupported` for what only CMake itself can do.
"""

HARMLESS_MODULES = frozenset(
    ("CMakeParseArguments", "CTest", "GNUInstallDirs", "CheckCXXCompilerFlag", "CheckCCompilerFlag")
)
"""Modules of CMake without commands that a package without compiled code would call."""
