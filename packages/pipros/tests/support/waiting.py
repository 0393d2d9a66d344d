"""Wait for conditions. No test sleeps for a fixed time."""

import threading
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

_POLL_INTERVAL_S = 0.01
_LONG_S, _LONG_INTERVAL_S = 0.5, 0.03
"""What has not happened after this time is polled less often: on a busy machine, polling delays it."""


def wait_until(
    condition: Callable[[], T],
    timeout_s: float = 60.0,
    what: str | Callable[[], str] = "",
    interval_s: float = _POLL_INTERVAL_S,
) -> T:
    """Poll `condition` every `interval_s`, after a while less often, and return its first true value.

    `what` is the text of the error: a description of the expected condition, or a function that describes
    the actual state.

    Raises:
        AssertionError: `condition` did not become true within `timeout_s`.
    """
    began = time.monotonic()
    pause = threading.Event()
    while True:
        waited_s = time.monotonic() - began  # read first, as this process may be stopped for a while
        value = condition()
        if value:
            return value
        if waited_s >= timeout_s:
            text = what() if callable(what) else what or getattr(condition, "__name__", repr(condition))
            raise AssertionError(f"not within {timeout_s} s: {text}")
        pause.wait(interval_s if waited_s < _LONG_S else max(interval_s, _LONG_INTERVAL_S))
