"""The configuration of the scene, and the `.rviz` file that it is read from and written to.

In `.rviz` files, scalars are kept as strings, as in rviz itself. Therefore, unknown keys, the order of keys,
and numbers such as `0.0299999993` are preserved when another property is changed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import open_file
from pipros.basics.replaced_file import overwritten_file
from pipros.safe.yaml import YamlError, load_texts
from pipros_page.bounded_list import PAGE_VIEW_BYTES


class SceneFile:
    """The configuration of the scene, which all browsers and the node's services share.

    Attributes:
        path: the file to save to; None if no file was opened.
        fixed_frame: overrides the file's fixed frame, if not empty.
        is_smooth: whether the scene is drawn with anti-aliasing.
        version: increases whenever a file is loaded.
    """

    def __init__(self, path: Path | None = None, fixed_frame: str = "", *, is_smooth: bool = True) -> None:
        self.path = path
        self.fixed_frame = fixed_frame
        self.is_smooth = is_smooth
        self.version = 0
        self.config: dict[str, Any] = {}
        if path is not None:
            self.load(path)

    def load(self, path: Path) -> None:
        """Read a file. From now on, `save` writes to this file.

        Raises:
            RvizFileError: the file is not an rviz configuration.
            OSError: the file cannot be read.
        """
        limit = PAGE_VIEW_BYTES
        with open_file(path) as file:
            content = file.read(limit + 1)
        if len(content) > limit:
            raise RvizFileError(f"{path} is too large; the limit is {limit} bytes")
        self.config = read_rviz(content, str(path))
        self.path = path
        self.version += 1

    def save(self, config: Any) -> Path:
        """Write the file, atomically.

        Raises:
            RvizFileError: the configuration cannot be written as a file, or no file was opened.
            OSError: the file cannot be written.
        """
        text = write_rviz(config)
        if self.path is None:
            raise RvizFileError("no file was opened; start rviz with -d FILE")
        self.path.parent.mkdir(exist_ok=True)
        with overwritten_file(self.path) as file:
            file.write(text.encode())
        self.config = config
        return self.path


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
