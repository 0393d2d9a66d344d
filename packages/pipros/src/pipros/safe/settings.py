"""Read a YAML settings file. Errors name the file, the line and the key."""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Iterator
from typing import Any

import yaml

from pipros.basics.errors import PiprosError
from pipros.basics.similar_names import similar_names
from pipros.safe.yaml import load


class BadSettings(PiprosError, ValueError):
    """A settings file is invalid, or does not match the bags or the robot that it refers to."""


class Settings:
    """A mapping in a YAML file.

    Attributes:
        key: the dotted name of the mapping; empty for the whole file.
        values: the items of the mapping.
    """

    def __init__(self, file: str, key: str, values: dict[str, Any], lines: dict[str, int]) -> None:
        self.key = key
        self.values = values
        self._file = file
        self._lines = lines

    @classmethod
    def parsed(cls, text: str, file: str) -> Settings:
        """Parse the text of a file.

        Raises:
            YamlError: the text is not YAML.
            BadSettings: the text is not a mapping, or a mapping contains a key twice.
        """
        values = load(text, file, angles=False)
        if not isinstance(values, dict):
            raise BadSettings(f"{file}: must be a mapping, got {type(values).__name__}")
        lines: dict[str, int] = {}
        _note_lines(yaml.compose(text, yaml.SafeLoader), "", lines, file)
        return cls(file, "", values, lines)

    def place(self, key: str = "") -> str:
        """Return the location of a key, for error texts: file, line and dotted name."""
        name = ".".join(part for part in (self.key, key) if part)
        line = self._lines.get(name) or self._lines.get(self.key)
        where = f"{self._file}:{line}" if line else self._file
        return f"{where}: {name}" if name else where

    def error(self, key: str, reason: str) -> BadSettings:
        """Return an error about a key."""
        return BadSettings(f"{self.place(key)}: {reason}")

    def only(self, known: Collection[str]) -> None:
        """Raise `BadSettings` if there is an unknown key."""
        for key in self.values:
            if key not in known:
                hint = similar_names(str(key), known) or f"The keys are {', '.join(sorted(known))}"
                raise self.error(str(key), f"unknown key. {hint}")

    def section(self, key: str) -> Settings:
        """Return the mapping below a key, which is empty if the key is missing."""
        values = self.values.get(key)
        if values is not None and not isinstance(values, dict):
            raise self.error(key, f"must be a mapping, got {values!r}")
        name = f"{self.key}.{key}" if self.key else key
        return Settings(self._file, name, values or {}, self._lines)

    def sections(self) -> Iterator[Settings]:
        """Yield the mapping below each key. Each key must be an identifier."""
        for key in self.values:
            if not isinstance(key, str) or not key.isidentifier():
                raise self.error(
                    str(key), "must consist of letters, digits and _, and must not start with a digit"
                )
            yield self.section(key)

    def text(self, key: str, default: str | None = None) -> str:
        """Return a string. If `default` is None, the string must be given and must not be empty."""
        value = self.values.get(key, default)
        if not isinstance(value, str) or (default is None and not value):
            rule = "must be a non-empty string" if default is None else "must be a string"
            raise self.error(key, "is missing" if value is None else f"{rule}, got {value!r}")
        return value

    def choice(self, key: str, choices: Collection[str], default: str) -> str:
        """Return a string that is one of `choices`."""
        value = self.text(key, default)
        if value not in choices:
            raise self.error(key, f"must be one of {', '.join(choices)}, got {value!r}")
        return value

    def number(self, key: str, default: float | None, *, least: float, most: float = math.inf) -> float:
        """Return a number from `least` to `most`. If `default` is None, the number must be given."""
        value = self.values.get(key, default)
        if value is None:
            raise self.error(key, "is missing")
        if not _is_number(value) or not least <= value <= most:
            rule = f"a finite number >= {least}" if most == math.inf else f"a number from {least} to {most}"
            raise self.error(key, f"must be {rule}, got {value!r}")
        return float(value)

    def numbers(self, key: str) -> tuple[float, ...]:
        """Return a number or a list of numbers as a tuple, which is empty if the key is missing."""
        value = self.values.get(key, [])
        found = value if isinstance(value, list) else [value]
        if not all(map(_is_number, found)):
            raise self.error(key, f"must be a number or a list of numbers, got {value!r}")
        return tuple(map(float, found))

    def texts(self, key: str) -> tuple[str, ...]:
        """Return a string or a list of strings as a tuple, which is empty if the key is missing."""
        value = self.values.get(key, [])
        found = value if isinstance(value, list) else [value]
        if not all(isinstance(each, str) for each in found):
            raise self.error(key, f"must be a string or a list of strings, got {value!r}")
        return tuple(found)


def _is_number(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) <= sys.float_info.max  # false for NaN, infinity, and integers that no float can hold


def _note_lines(node: object, name: str, lines: dict[str, int], file: str) -> None:
    """Store the line of each key by its dotted name. Raise `BadSettings` if a mapping has a key twice."""
    if isinstance(node, yaml.MappingNode):
        known: set[str] = set()
        for key, value in node.value:
            if key.value in known:
                raise BadSettings(f"{file}:{key.start_mark.line + 1}: the key {key.value} occurs twice")
            known.add(key.value)
            below = f"{name}.{key.value}" if name else str(key.value)
            lines[below] = key.start_mark.line + 1
            _note_lines(value, below, lines, file)
