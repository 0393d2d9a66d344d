"""Waits that every signal interrupts.

Python runs signal handlers between two byte codes of the main thread. A signal that arrives just
before that thread begins to wait is handled only after the wait: an endless wait would lose
Ctrl-C. So every wait of a main thread consists of short slices.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import TypeVar

SLICE_S = 0.2

_Item = TypeVar("_Item")


def wait_in_slices(wait_for: Callable[[float], bool], timeout_s: float | None = None) -> bool:
    """Waits with `wait_for`, such as `event.wait`; False when the time is over."""
    if timeout_s is not None and timeout_s <= SLICE_S:
        return wait_for(max(timeout_s, 0))
    end = None if timeout_s is None else time.monotonic() + timeout_s
    while True:
        left_s = SLICE_S if end is None else min(SLICE_S, end - time.monotonic())
        if wait_for(max(left_s, 0)):
            return True
        if end is not None and time.monotonic() >= end:
            return False


def take_within_slice(queue: SimpleQueue[_Item], timeout_s: float = SLICE_S) -> _Item | None:
    """The next item of a queue, or None after the timeout, which is limited to one slice."""
    try:
        return queue.get(timeout=max(0.0, min(SLICE_S, timeout_s)))
    except Empty:
        return None
