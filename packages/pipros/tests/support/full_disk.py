"""A disk on which files cannot grow. Tests that use it have the mark `needs("resource limits")`."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

if sys.platform != "win32":
    import resource


@contextmanager
def files_limited_to(size: int) -> Iterator[None]:
    """Make writing fail with an OSError, as on a full disk, once a file has `size` bytes.

    This includes the file to which pytest redirects the output.
    """
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
