"""Wait for conditions. No test sleeps for a fixed time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

_POLL_INTERVAL_S = 0.01


def wait_until(condition: Callable[[], T], timeout_s: float = 60.0, what: str | Callable[[], str] = "") -> T:
    """Poll `condition`, and return its first true value.

    `what` is the text of the error: a description of the expected condition, or a function that describes
    the actual state.

    Raises:
        AssertionError: `condition` did not become true within `timeout_s`.
    """
    deadline = time.monotonic() + timeout_s
    pause = threading.Event()
    while True:
        is_last = time.monotonic() >= deadline  # read first, as this process may be stopped for a while
        value = condition()
        if value:
            return value
        if is_last:
            text = what() if callable(what) else what or getattr(condition, "__name__", repr(condition))
            raise AssertionError(f"not within {timeout_s} s: {text}")
        pause.wait(_POLL_INTERVAL_S)
