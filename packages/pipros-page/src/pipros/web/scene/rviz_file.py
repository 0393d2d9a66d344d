"""Read and write rviz's configuration files (`.rviz`).

Scalars are kept as strings, as in rviz itself. Therefore, unknown keys, the order of keys, and numbers
such as `0.0299999993` are preserved when another property is changed.
"""

from __future__ import annotations

from typing import Any

import yaml

from pipros.basics.errors import PiprosError
from pipros.safe.yaml import YamlError, load_texts

MANAGER = "Visualization Manager"


class RvizFileError(PiprosError, ValueError):
    """A file or value is not an rviz configuration."""


class _TextDumper(yaml.Dumper):
    """Writes strings without quotes if a reader that keeps scalars as strings can read them back."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 # declared so by PyYAML

    def ignore_aliases(self, data: object) -> bool:  # noqa: ARG002 # rviz writes no aliases
        return True


def read_rviz(content: bytes | str, file: str = "<string>") -> dict[str, Any]:
    """Return the mapping in a `.rviz` file. Values are strings, lists and mappings.

    Raises:
        RvizFileError: the content is not YAML, exceeds the limits on YAML, or is not an rviz configuration.
    """
    try:
        found = load_texts(content, file)
    except YamlError as error:
        raise RvizFileError(str(error)) from None
    if not isinstance(found, dict) or not isinstance(found.get(MANAGER), dict):
        reason = "an rviz configuration must have the key 'Visualization Manager'"
        if file.endswith(".vcg"):
            reason += "; .vcg files from rviz before Groovy cannot be read"
        raise RvizFileError(f"{file}: {reason}")
    return found


def write_rviz(config: object) -> str:
    """Return the content of a `.rviz` file.

    Raises:
        RvizFileError: a value is not a string, list or mapping, or the result could not be read back.
    """
    _check(config, 0)
    text = yaml.dump(config, Dumper=_TextDumper, sort_keys=False, allow_unicode=True, width=1_000_000)
    read_rviz(text)
    return text


def _check(value: object, depth: int) -> None:
    if depth > 100:
        raise RvizFileError("values must be nested at most 100 levels deep")
    if isinstance(value, dict):
        for key, part in value.items():
            _check(key, depth + 1)
            _check(part, depth + 1)
    elif isinstance(value, list):
        for part in value:
            _check(part, depth + 1)
    elif not isinstance(value, str):
        raise RvizFileError(f"values must be strings, lists and mappings, got {value!r:.100}")
