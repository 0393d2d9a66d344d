"""`file(GLOB …)`: the paths that patterns mean."""

from __future__ import annotations

import fnmatch
import os
import re
from collections.abc import Iterator

_WILD = re.compile(r"[*?\[]")


def matching(pattern: str, *, with_folders: bool) -> list[str]:
    """The paths that an absolute pattern means; hidden ones too, as CMake has it."""
    found = [""]
    for part in pattern.split("/")[1:]:
        if _WILD.search(part):
            found = [
                os.path.join(folder, name)
                for folder in (base or "/" for base in found)
                for name in _names(folder)
                if fnmatch.fnmatchcase(name, part)
            ]
        else:
            found = [f"{base}/{part}" for base in found if os.path.lexists(f"{base}/{part}")]
    return [path for path in found if with_folders or not os.path.isdir(path)]


def matching_below(pattern: str, *, with_folders: bool) -> Iterator[str]:
    """The paths whose names match the last part of a pattern, in all folders below what the others mean."""
    base, _, last = pattern.rpartition("/")
    for root in matching(base, with_folders=True) if _WILD.search(base) else [base]:
        for folder, folders, files in os.walk(root):
            names = [*files, *folders] if with_folders else files
            yield from (os.path.join(folder, name) for name in names if fnmatch.fnmatchcase(name, last))


def _names(folder: str) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:
        return []
