"""Read and write rviz's configuration files (`.rviz`).

All scalars stay texts, as in rviz itself, whose properties convert them. So unknown keys, their order, and
numbers such as `0.0299999993` survive a change of another property.
"""

from __future__ import annotations

from typing import Any

import yaml

from pipros.basics.errors import PiprosError
from pipros.safe.yaml import YamlError, load_texts

MANAGER = "Visualization Manager"


class RvizFileError(PiprosError, ValueError):
    """A text is not a configuration of rviz."""


class _TextDumper(yaml.Dumper):
    """Writes strings without quotes, if they are not ambiguous for a reader that takes scalars as texts."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 # declared so by PyYAML

    def ignore_aliases(self, data: object) -> bool:  # noqa: ARG002 # rviz writes none
        return True


def read_rviz(content: bytes | str, file: str = "<string>") -> dict[str, Any]:
    """Return the mapping in a `.rviz` file. Values are texts, lists and mappings.

    Raises:
        RvizFileError: the content is not YAML, exceeds the limits of YAML, or is not a configuration of rviz.
    """
    try:
        found = load_texts(content, file)
    except YamlError as error:
        raise RvizFileError(str(error)) from None
    if not isinstance(found, dict) or not isinstance(found.get(MANAGER), dict):
        reason = "a configuration of rviz must have the key 'Visualization Manager'"
        if file.endswith(".vcg"):
            reason += "; files of rviz before Groovy (.vcg) cannot be read"
        raise RvizFileError(f"{file}: {reason}")
    return found


def write_rviz(config: Any) -> str:
    """Return the text of a `.rviz` file.

    Raises:
        RvizFileError: a value is not a text, list or mapping, or the result cannot be read again.
    """
    _check(config, 0)
    text = yaml.dump(config, Dumper=_TextDumper, sort_keys=False, allow_unicode=True, width=1_000_000)
    read_rviz(text)
    return text


def _check(value: Any, depth: int) -> None:
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
        raise RvizFileError(f"values must be texts, lists and mappings, got {value!r:.100}")
