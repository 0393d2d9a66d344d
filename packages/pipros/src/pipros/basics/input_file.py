"""Read regular files from untrusted sources, up to a size limit. Pipes and devices are rejected."""

from __future__ import annotations

import errno
import os
from stat import S_ISREG

from pipros.basics.posix import READ


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
    descriptor = os.open(path, READ)
    with open(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", os.fspath(path))
        # Memory for the limit is allocated only if needed: Wine touches each of its pages.
        content = file.read(min(status.st_size, limit_bytes) + 1)
        if len(content) > status.st_size:  # the file grows, or has no size, as in /proc
            content += file.read(limit_bytes + 1 - len(content))
    if len(content) > limit_bytes:
        raise OSError(errno.EFBIG, f"it is larger than {limit_bytes} bytes", os.fspath(path))
    return content


def read_end(path: str | os.PathLike[str], max_bytes: int) -> str:
    """Return the last `max_bytes` of a regular file, decoded as UTF-8, without a partial first line.

    Raises:
        OSError: the file cannot be read, or is not a regular file.
    """
    descriptor = os.open(path, READ)
    with open(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", os.fspath(path))
        begin = max(0, status.st_size - max_bytes)
        file.seek(begin)
        content = file.read(max_bytes)
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
