"""The folder whose bags a page may open. Names and links that lead out of the folder are refused."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from pipros.basics.files_below import NotBelow, file_inside
from pipros_tools.bag.errors import BagError

ENDINGS: Final = (".bag", ".mcap", ".bag.active")
MAX_FILES: Final = 1000
MAX_EXAMINED: Final = 20_000
"""Maximum number of directory entries that a listing reads."""
_LONGEST_NAME: Final = 1000


class BadBagName(BagError):
    """A name does not denote a bag in the folder."""


class BagFolder:
    """The bags in a folder and its subfolders. All methods block.

    Args:
        path: the folder. Links are followed only if their targets are inside it.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path: Final = Path(path).resolve()

    def names(self) -> list[tuple[str, int]]:
        """Return the names and sizes in bytes of the newest `MAX_FILES` bags, newest first.

        Names are relative to the folder.
        """
        found: list[tuple[float, str, int]] = []
        left = MAX_EXAMINED
        for folder, _, files in os.walk(self.path):  # os.walk does not follow links to folders
            left -= len(files) + 1
            if left < 0:
                break
            for name in files:
                path = Path(folder, name)
                try:
                    known = self.find(path.relative_to(self.path).as_posix()).stat()
                except (BagError, OSError):
                    continue
                found.append((known.st_mtime, path.relative_to(self.path).as_posix(), known.st_size))
        return [(name, size) for _, name, size in sorted(found, reverse=True)[:MAX_FILES]]

    def find(self, name: object) -> Path:
        """Return the path of a bag.

        Raises:
            BadBagName: there is no bag of this name, or the name leads out of the folder.
        """
        if not isinstance(name, str) or not name.endswith(ENDINGS) or len(name) > _LONGEST_NAME:
            rule = f"must end in .bag, .mcap or .bag.active and have at most {_LONGEST_NAME} characters"
            raise BadBagName(f"a bag's name {rule}, got {name!r:.100}")
        try:
            return file_inside(self.path, name)
        except NotBelow as error:
            raise BadBagName(str(error)) from None
