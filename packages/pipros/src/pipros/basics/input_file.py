"""Read regular files from untrusted sources, up to a size limit. Pipes and devices are rejected."""

from __future__ import annotations

import errno
import os
from stat import S_IFDIR, S_ISDIR, S_ISREG
from typing import BinaryIO

from pipros.basics.posix import READ


def open_file(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a regular file for reading. A pipe, which may never have a writer, is not waited for.

    Raises:
        OSError: the file cannot be read, or is not a regular file; `strerror` says which.
    """
    try:
        return open(path, "rb", opener=_descriptor)  # so that the file's name is the path
    except ValueError:
        raise OSError(errno.EINVAL, "no file can have this name", os.fspath(path)) from None


def _descriptor(path: str, _flags: int) -> int:
    try:
        descriptor = os.open(path, READ)
    except PermissionError:  # so Windows refuses a folder
        if not os.path.isdir(path):
            raise
        mode = S_IFDIR
    else:
        mode = os.fstat(descriptor).st_mode
        if S_ISREG(mode):
            return descriptor
        os.close(descriptor)
    if S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), path)
    raise OSError(errno.EINVAL, "it is not a regular file", path)


def read_file(path: str | os.PathLike[str], limit_bytes: int | None = None) -> bytes:
    """Return the content of a regular file.

    Args:
        limit_bytes: defaults to the process-wide limit `file_bytes`.

    Raises:
        OSError: the file cannot be read, is larger than the limit, or is not a regular file; `strerror` says
            which.
    """
    if limit_bytes is None:
        from pipros.basics.limits import process_limits

        limit_bytes = process_limits().file_bytes
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        # Memory for the limit is allocated only if needed: Wine touches each of its pages.
        content = file.read(min(size, limit_bytes) + 1) or b""  # None from /proc/kmsg, which has no more now
        if len(content) > size:  # the file grows, or has no size, as in /proc
            content += file.read(limit_bytes + 1 - len(content)) or b""
    if len(content) > limit_bytes:
        raise OSError(errno.EFBIG, f"it is larger than {limit_bytes} bytes", os.fspath(path))
    return content


def read_end(path: str | os.PathLike[str], max_bytes: int) -> str:
    """Return the last `max_bytes` of a regular file, decoded as UTF-8, without a partial first line.

    Raises:
        OSError: the file cannot be read, or is not a regular file.
    """
    with open_file(path) as file:
        begin = max(0, os.fstat(file.fileno()).st_size - max_bytes)
        file.seek(begin)
        content = file.read(max_bytes) or b""
    if begin:
        content = content.partition(b"\n")[2]
    return content.decode("utf-8", "replace")


def read_text(path: str | os.PathLike[str], limit_bytes: int | None = None, *, errors: str = "strict") -> str:
    """Return the content of a regular file, decoded as UTF-8, with `\\n` line endings.

    A byte order mark, with which some editors on Windows begin a file, is left out.

    Args:
        errors: how invalid bytes are handled, as in `bytes.decode`.

    Raises:
        OSError: the same as for `read_file`.
        UnicodeDecodeError: the content is not UTF-8, and `errors` is `strict`.
    """
    text = read_file(path, limit_bytes).decode("utf-8", errors).removeprefix("\ufeff")
    return text.replace("\r\n", "\n").replace("\r", "\n")
