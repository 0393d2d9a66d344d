"""Write a file that appears as a whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pipros.basics.windows import replace_file


@contextmanager
def replaced_file(path: Path) -> Iterator[Any]:
    """Context manager that opens a new binary file, which atomically replaces `path` at the end.

    If the block raises an exception, the new file is removed and `path` stays unchanged. If an OSError does
    not have a file name (for example, if the disk is full), its file name is set to `path`.
    """
    unfinished = path.with_name(path.name + ".active")
    try:
        with unfinished.open("w+b") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        replace_file(unfinished, path)
    except BaseException as error:
        unfinished.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(path)
        raise
