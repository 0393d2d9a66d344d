"""Unpack the packages shipped with pipros if it runs from a zip file: programs open their files."""

from __future__ import annotations

import os
import shutil
import tempfile
import zipfile
from hashlib import sha256

_EXECUTABLE = 0o111


def unpacked(path: str, cache: str) -> str:
    """Return the folder with the content of a folder whose path leads into a zip file.

    Each state of the zip file is unpacked once, below the folder `cache`.

    Raises:
        OSError: the folder cannot be written.
    """
    archive = path
    while not os.path.exists(archive):
        archive = os.path.dirname(archive)
    inside = os.path.relpath(path, archive)
    stat = os.stat(archive)
    state = f"{os.path.abspath(path)} {stat.st_mtime_ns} {stat.st_size}"
    folder = os.path.join(cache, sha256(os.fsencode(state)).hexdigest()[:16])
    if not os.path.isdir(folder):
        os.makedirs(cache, exist_ok=True)
        # Another process may do the same: the first one that is ready renames its folder.
        unfinished = tempfile.mkdtemp(dir=cache)
        try:
            _unpack(archive, inside.replace(os.sep, "/"), unfinished)
            os.rename(unfinished, folder)
        except OSError:
            if not os.path.isdir(folder):
                raise
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
    return os.path.join(folder, inside)


def _unpack(archive: str, inside: str, folder: str) -> None:
    with zipfile.ZipFile(archive) as content:
        for member in content.infolist():
            if member.filename.startswith(f"{inside}/") and not member.is_dir():
                file = content.extract(member, folder)
                os.chmod(file, os.stat(file).st_mode | (member.external_attr >> 16 & _EXECUTABLE))
