"""The state that CMake commands read and change: variables, the cache and the environment."""

from __future__ import annotations

import os
from collections import ChainMap
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from contextlib import contextmanager

from pipros.basics.windows import with_slashes

CMAKE_VALUE_CHARACTERS = 4 * 1024 * 1024
"""Limit: the value of one CMake variable, or the arguments of one command. Beyond it, the build of the
package fails; the error names the file and line.
"""
CMAKE_CHARACTERS = 64 * 1024 * 1024
"""Limit: all of a package's CMake variables together. Beyond it, the build of the package fails; the error
names the file and line.
"""


class _Values(ChainMap[str, str]):
    """A dictionary of variables whose total size is limited."""

    def __init__(self, variables: dict[str, str], cache: dict[str, str]) -> None:
        super().__init__(variables, cache)
        self.characters = 0

    def __setitem__(self, name: str, value: str) -> None:
        check_length(len(value))
        characters = self.characters + len(value) - len(self.maps[0].get(name, ""))
        if characters > CMAKE_CHARACTERS:
            raise ValueError(f"the variables have more than {CMAKE_CHARACTERS} characters in total")
        self.characters = characters
        super().__setitem__(name, value)


def check_length(characters: int) -> None:
    """Raise ValueError if a string of this length would be too long for a value.

    Call this before building the string.
    """
    if characters > CMAKE_VALUE_CHARACTERS:
        raise ValueError(f"produces a string of more than {CMAKE_VALUE_CHARACTERS} characters")


class Scope:
    """The variables of the current function or folder, with the cache entries as a fallback.

    Attributes:
        values: the values for `${NAME}`. Setting an item sets a variable, never a cache entry.
        cache: entries that apply to all folders, such as `-D` settings, options and results of
            `find_program()`.
        environment: the values for `$ENV{NAME}`. Programs are run with this environment.
        properties: the global properties.
    """

    def __init__(
        self,
        variables: Mapping[str, str],
        cache: Mapping[str, str],
        environment: Mapping[str, str],
    ) -> None:
        self._variables = dict(variables)
        self.cache = dict(cache)
        self._values = _Values(self._variables, self.cache)
        self.values: MutableMapping[str, str] = self._values
        self.environment = dict(environment)
        self.properties: dict[str, str] = {}
        self._for_parent: list[dict[str, str | None]] = [{}]

    def unset(self, name: str) -> None:
        """Remove a variable if it is set. A cache entry with that name is kept."""
        self._values.characters -= len(self._variables.pop(name, ""))

    def set_in_parent(self, name: str, value: str | None) -> None:
        """Set a variable in the enclosing scope when the current one ends; unset it if `value` is None."""
        self._for_parent[-1][name] = value

    @contextmanager
    def inner(self) -> Iterator[None]:
        """Open a scope for a function, block or folder.

        When the scope ends, its variables are discarded, and those set by `set_in_parent` are assigned in the
        outer scope.
        """
        before, characters = dict(self._variables), self._values.characters
        self._for_parent.append({})
        try:
            yield
        finally:
            self._variables.clear()
            self._variables.update(before)
            self._values.characters = characters
            for name, value in self._for_parent.pop().items():
                if value is None:
                    self.unset(name)
                else:
                    self.values[name] = value

    @contextmanager
    def restored(self, names: Iterable[str]) -> Iterator[None]:
        """Return a context manager that restores the current values of the given variables on exit.

        The values are not restored after an exception.
        """
        before = {name: self.values.get(name) for name in names}
        yield
        for name, value in before.items():
            if value is None:
                self.unset(name)
            else:
                self.values[name] = value

    def in_source(self, path: str) -> str:
        """Return the absolute path of an input file, which may be relative to the current source folder."""
        return with_slashes(
            os.path.normpath(os.path.join(self.values.get("CMAKE_CURRENT_SOURCE_DIR", ""), path))
        )

    def in_binary(self, path: str) -> str:
        """Return the absolute path of an output file, which may be relative to the current binary folder."""
        return with_slashes(
            os.path.normpath(os.path.join(self.values.get("CMAKE_CURRENT_BINARY_DIR", ""), path))
        )


ValueCommand = Callable[[list[str], Scope], None]
"""A command that needs only the scope. Raises ValueError for wrong arguments, or `Unsupported`."""


class Unsupported(Exception):
    """A command requires a feature that only CMake itself provides. The error text names the feature."""
