"""An on-disk cache of the declarations in `.cfg` files.

The key of an entry is a digest of the file's path and contents, the interpreter that ran the file, and
pipros's code for such files. The entry is valid as long as the modules that the file imported are unchanged.
pipros's modules and modules installed in the interpreter's environment are not checked. Neither are other
inputs, such as environment variables and other files.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

from pipros.basics.cache_files import CacheFolder
from pipros.basics.input_file import read_file
from pipros.packages import cache_folder

SOURCES = "sources"
"""Key of the imported modules in a cached entry, beside the keys of the declarations."""

_CODE = ("cache.py", "cfg_file.py", "generator.py")


def sources(modules: Iterable[ModuleType]) -> list[list[Any]]:
    """Return the path, size and modification time of each module's file.

    pipros's modules and modules installed in the interpreter's environment are omitted.
    """
    source_folder = str(Path(__file__).resolve().parents[2])
    fixed = tuple(
        os.path.join(os.path.realpath(folder), "")
        for folder in {sys.prefix, sys.base_prefix, sys.exec_prefix, source_folder}
    )
    found = []
    for module in modules:
        file = getattr(module, "__file__", None)
        if (
            file is not None
            and module.__name__ != "__main__"
            and not os.path.realpath(file).startswith(fixed)
        ):
            found.append([os.path.abspath(file), *_stamp(file)])
    return found


def recall(path: Path) -> dict[str, Any] | None:
    """Return the cached declarations of a file, or None if the file must be run.

    Raises:
        OSError: the file cannot be read.
    """
    content = _folder().read(_entry(path))
    if content is None:
        return None
    try:
        declared = json.loads(content)
        current = all(_stamp(file) == stamp for file, *stamp in declared[SOURCES])
        current = current and declared.keys() >= {"name", "description", "constants"}
    except (AttributeError, KeyError, OSError, RecursionError, TypeError, ValueError):
        return None
    return declared if current else None


def keep(path: Path, declared: dict[str, Any]) -> None:
    """Cache the declarations of a file, if possible."""
    _folder().write(_entry(path), json.dumps(declared).encode())


def _folder() -> CacheFolder:
    return CacheFolder(cache_folder("cfg"))


def _entry(path: Path) -> str:
    here = Path(__file__).parent
    parts = [
        os.path.abspath(path),
        hashlib.sha256(read_file(path)).hexdigest(),
        sys.executable,
        sys.version,
        *(f"{name} {_stamp(here / name)}" for name in _CODE),
    ]
    return hashlib.sha256("\n".join(parts).encode("utf-8", "surrogateescape")).hexdigest() + ".json"


def _stamp(file: str | Path) -> list[int]:
    status = os.stat(file)
    return [status.st_size, status.st_mtime_ns]
