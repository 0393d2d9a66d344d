"""Update the stubs of packages when their definitions change (`pipros stubs --watch`, `catkin_make`)."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from pipros.basics.errors import NotFound, PiprosError
from pipros.msg.importing.hook import installed_library
from pipros.msg.language.definition_files import NOUNS, DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros.msg.stubs import write_stubs
from pipros.packages import has_only_messages


class StubFiles:
    """The stubs of some packages, in a folder.

    Args:
        suffix: see `write_stubs`.
    """

    def __init__(self, packages: Sequence[str], folder: Path, *, suffix: str = "") -> None:
        self._packages = list(packages)
        self._folder = folder
        self._suffix = suffix
        self._written: dict[str, tuple[object, ...]] = {}

    def update(self, report: Callable[[PiprosError | OSError], object] | None = None) -> list[Path]:
        """Write the stubs of packages whose definitions have changed. Return the paths of these stubs.

        After an error, a package is not retried until its definitions have changed.

        Args:
            report: called with the error of each package that is left out, instead of raising it.

        Raises:
            NotFound: a package does not exist.
            DefinitionError: a definition is invalid.
            OSError: a file cannot be written.
        """
        paths: list[Path] = []
        for package in self._packages:
            state = self._state(package)
            if state == self._written.get(package):
                continue
            self._written[package] = state
            definitions = Definitions(DefinitionFiles(installed_library().files.folder))
            try:
                paths += write_stubs(
                    [package], self._folder, definitions, suffix=self._suffix, has_module=has_python_modules
                )
            except (PiprosError, OSError) as error:
                if report is None:
                    raise
                report(error)
        return paths

    def _state(self, package: str) -> tuple[object, ...]:
        """Return the names, times and sizes of the package's definitions."""
        try:
            home = installed_library().files.folder(package)
        except NotFound:
            return ()  # `write_stubs` reports the missing package
        found = []
        for kind in NOUNS:
            for folder, _, names in os.walk(os.path.join(home, kind)):
                for name in names:
                    file = os.path.join(folder, name)
                    try:
                        status = os.stat(file)
                    except OSError:
                        continue  # the file has just been removed; editors do this when they save
                    found.append((file, status.st_mtime_ns, status.st_size))
        return tuple(sorted(found))


def has_python_modules(package: str) -> bool:
    """Return whether a package has Python files, and not only messages and services."""
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return False
    if spec is None or spec.origin is None or not os.path.isfile(spec.origin):
        return False
    return not has_only_messages(os.path.dirname(spec.origin))
