"""Find files below a folder, without leaving it through `..` or symbolic links."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.printable import printable


class NotBelow(PiprosError):
    """The name does not refer to a file below the folder."""


MOST_FILES: Final = 5000
"""Maximum number of files that `files_below` examines."""


def file_inside(folder: Path, name: str) -> Path:
    """Return the real path of the file `name`, which is relative to a folder.

    Raises:
        NotBelow: the file does not exist, `name` is absolute or contains `..` or a backslash, or a link leads
            out of the folder.
    """
    path = Path(name)
    if not path.parts or path.is_absolute() or ".." in path.parts or "\\" in name:
        raise NotBelow(
            "a file must be named relative to its folder, without '..' or backslashes, "
            f"got [{printable(name)}]"
        )
    root = Path(os.path.realpath(folder))
    with suppress(OSError, ValueError):  # no file can have this name
        found = Path(os.path.realpath(root / name))
        if found.is_relative_to(root) and found.is_file():
            return found
    raise NotBelow(f"no file [{printable(name)}] below this folder; links out of it are not followed")


def files_below(folder: Path, suffixes: tuple[str, ...], most: int = MOST_FILES) -> Iterator[str]:
    """Yield the names of files with these suffixes below a folder, relative to it with `/`, and in order.

    Hidden files and folders, and links out of the folder, are skipped. At most `most` files are examined.
    """
    root = os.path.realpath(folder)
    left = most
    for path, folders, files in os.walk(root):
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        for name in sorted(files):
            left -= 1
            if left < 0:
                return
            file = os.path.join(path, name)
            is_inside = Path(os.path.realpath(file)).is_relative_to(root)
            if name.endswith(suffixes) and not name.startswith(".") and is_inside:
                yield os.path.relpath(file, root).replace(os.sep, "/")
