"""Servers of rosbridge without WebSockets, for a block of a test."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def running(server: Any) -> Iterator[int]:
    """Start a server, and close it after the block. The value is its port."""
    try:
        yield server.start()
    finally:
        server.close()
