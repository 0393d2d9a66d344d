"""What the commands of CMake see and change: variables, the cache, the environment."""

from __future__ import annotations

import os
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from contextlib import contextmanager


class Scope:
    """The variables at one place, those of the cache behind them.

    Attributes:
        values: what `${NAME}` stands for; what is set, is set here.
        cache: what holds everywhere: settings of the command line, options, programs that were found.
        environment: what `$ENV{NAME}` stands for, and what programs are given.
        properties: of the whole project.
    """

    def __init__(
        self, variables: Mapping[str, str], cache: Mapping[str, str], environment: Mapping[str, str]
    ) -> None:
        self._variables = dict(variables)
        self.cache = dict(cache)
        self.values: MutableMapping[str, str] = ChainMap(self._variables, self.cache)
        self.environment = dict(environment)
        self.properties: dict[str, str] = {}
        self._for_parent: list[dict[str, str | None]] = [{}]

    def unset(self, name: str) -> None:
        self._variables.pop(name, None)

    def set_in_parent(self, name: str, value: str | None) -> None:
        """Sets a variable, or unsets it, where the function or folder of the moment was called."""
        self._for_parent[-1][name] = value

    @contextmanager
    def inner(self) -> Iterator[None]:
        """Variables that are set meanwhile are forgotten afterwards, unless they were set for the parent."""
        before = dict(self._variables)
        self._for_parent.append({})
        try:
            yield
        finally:
            self._variables.clear()
            self._variables.update(before)
            for name, value in self._for_parent.pop().items():
                if value is None:
                    self.unset(name)
                else:
                    self._variables[name] = value

    def in_source(self, path: str) -> str:
        """A path as it is meant where a file is read."""
        return os.path.normpath(os.path.join(self.values.get("CMAKE_CURRENT_SOURCE_DIR", ""), path))

    def in_binary(self, path: str) -> str:
        """A path as it is meant where a file is made."""
        return os.path.normpath(os.path.join(self.values.get("CMAKE_CURRENT_BINARY_DIR", ""), path))


ValueCommand = Callable[[list[str], Scope], None]
"""A command that computes something: gets its words. Raises ValueError for words that make no sense."""


class Unsupported(Exception):
    """A command wants what only the real CMake can do."""
