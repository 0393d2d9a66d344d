"""Limits on the memory that a block of code uses."""

import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def memory_of(max_bytes: int) -> Iterator[None]:
    """Fail if the Python objects created in the block use more than `max_bytes` at any time."""
    tracemalloc.start()
    try:
        yield
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < max_bytes, f"{peak} bytes"
