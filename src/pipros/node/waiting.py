"""Waits that a signal always gets through to."""

from __future__ import annotations

import time
from collections.abc import Callable

#: A signal that arrives in the very moment in which a wait of the main thread begins is looked at by
#: Python when that wait is over: an endless wait would lose Ctrl-C.
SLICE_S = 0.2


def wait_in_slices(wait_for: Callable[[float], bool], timeout_s: float | None = None) -> bool:
    """Waits with `wait_for`, such as `event.wait`; False when the time is over first."""
    if timeout_s is not None and timeout_s <= SLICE_S:
        return wait_for(max(timeout_s, 0))
    end = None if timeout_s is None else time.monotonic() + timeout_s
    while True:
        left_s = SLICE_S if end is None else min(SLICE_S, end - time.monotonic())
        if wait_for(max(left_s, 0)):
            return True
        if end is not None and time.monotonic() >= end:
            return False
