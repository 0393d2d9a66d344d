"""Zip archives of the home folder, which the page downloads and opens: `python3 -m pipros_tab.archives`."""

from __future__ import annotations

import os
import re
import stat
import sys
import zipfile
import zlib
from pathlib import Path
from typing import Final

from pipros_tab.files import write

MOST_BYTES: Final = 256 * 2**20
_ODD_NAME: Final = re.compile(r"/|.*//|(.*/)?\.{1,2}(/|$)|.*[\x00-\x1f\x7f-\x9f\\]|$", re.DOTALL)


def pack(home: Path, path: Path) -> tuple[int, list[str]]:
    """Write the files and folders of the home folder, without what is built. Return their number."""
    path.parent.mkdir(exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, strict_timestamps=False) as archive:
        for parent, folders, names in os.walk(home):
            folders[:] = sorted(
                name for name in folders if name not in (".ros", "__pycache__", "build", "devel")
            )
            for file in (Path(parent, name) for name in (*folders, *sorted(names))):
                archive.write(file, file.relative_to(home))
        return len(archive.filelist), []


def unpack(home: Path, path: Path, most: int = MOST_BYTES) -> tuple[int, list[str]]:
    """Write what an archive contains. Return the number of files and folders, and what is left out, and why.

    Raises ValueError if it contains more bytes than `most`, and BadZipFile if it is not a zip archive.
    """
    left_out = []
    with zipfile.ZipFile(path) as archive:
        entries = archive.infolist()
        if sum(entry.file_size for entry in entries) > most:  # no entry is read beyond its size
            raise ValueError("the files of this archive are too large for a tab")
        for entry in entries:
            name = entry.orig_filename
            mode = stat.S_IFDIR if entry.is_dir() else entry.external_attr >> 16 or 0o644
            try:
                if _ODD_NAME.match(name):
                    raise ValueError("its name is refused")
                write(str(home / name), mode, archive.read(entry))
            except (OSError, ValueError, RuntimeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
                left_out.append(f"{name}: {error}")
    return len(entries) - len(left_out), left_out


def main(arguments: list[str]) -> int:
    """Run `pack ARCHIVE` or `unpack ARCHIVE`, and print one line for the page."""
    order, path = arguments
    try:
        count, left_out = {"pack": pack, "unpack": unpack}[order](Path.home(), Path(path))
    except (ValueError, zipfile.BadZipFile) as error:
        print(error)
        return 1
    lost = f"; {len(left_out)} are left out, such as {left_out[0]}" if left_out else ""
    print(f"{order}ed {count} files and folders{lost}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
