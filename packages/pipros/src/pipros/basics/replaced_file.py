"""Write a file that appears as a whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pipros.basics.planted import refuse_planted
from pipros.basics.windows import replace_file


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Context manager that sets the file name of an OSError that has none, for example of a full disk."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


def cleared(path: Path) -> Path:
    """Remove what an interrupted program left at `path`, an unfinished file, and return the path.

    The caller creates a new file (mode `x`), because opening what is there would follow a link that another
    user of the folder may have made.

    Raises:
        OSError: it cannot be removed, or there is no folder for it. The file name is `path`, in the latter
            case without `.active`.
    """
    refuse_planted(path.parent)
    if not path.parent.exists():
        reason = f"there is no folder {path.parent}"
        raise FileNotFoundError(errno.ENOENT, reason, str(path).removesuffix(".active"))
    try:
        path.unlink(missing_ok=True)
    except PermissionError as error:
        reason = f"cannot remove {path.name} ({error.strerror}); remove it, or write to another folder"
        raise PermissionError(error.errno, reason, str(path)) from None
    return path


@contextmanager
def replaced_file(path: Path, *, is_synced: bool = True) -> Iterator[Any]:
    """Context manager that opens a new binary file, which atomically replaces `path` at the end.

    If the block raises an exception, the new file is removed and `path` stays unchanged. If an OSError does
    not have a file name (for example, if the disk is full), its file name is set to `path`. With `is_synced`,
    the content also survives a power failure right afterwards, which takes milliseconds for each file.
    """
    unfinished = cleared(path.with_name(path.name + ".active"))
    try:
        with naming(path):
            with unfinished.open("x+b") as file:
                yield file
                file.flush()
                if is_synced:
                    os.fsync(file.fileno())
            replace_file(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


@contextmanager
def overwritten_file(path: Path, *, is_synced: bool = True) -> Iterator[Any]:
    """Context manager that opens a binary file with the new content of `path`, which the user named.

    It is like `replaced_file`, so that an old file is not lost if the disk is full, but keeps links and
    permissions. What is not a file, such as a terminal or a pipe, is written directly, and so are
    `/dev/stdout` and a file in a folder in which none can be created. The file name of an OSError is `path`.

    Raises:
        UntrustedFile: see `refuse_planted`.
    """
    refuse_planted(path)
    # Wine cannot resolve paths of 260 characters and more.
    target = Path(os.path.realpath(path)) if path.is_symlink() else path
    try:
        # Links to what another program reads or has opened; /dev/shm has files.
        is_stream = path.is_symlink() and os.path.abspath(path).startswith(("/dev/", "/proc/"))
        if path.exists() and (is_stream or not path.is_file() or not os.access(target.parent, os.W_OK)):
            with path.open("wb") as file:  # the target of a link to a pipe does not exist
                yield file
            return
        if target.exists():
            target.open("ab").close()  # a read-only file is not replaced
        with replaced_file(target, is_synced=is_synced) as file:
            if target.exists():
                shutil.copymode(target, file.name)
            yield file
    except OSError as error:
        if error.filename in (None, str(target), f"{target}.active"):
            error.filename = str(path)
            del error.filename2
        raise


def write_whole(path: Path, content: bytes) -> None:
    """Write a file that can be written again, such as one of a build; see `overwritten_file`."""
    with overwritten_file(path, is_synced=False) as file:
        file.write(content)
