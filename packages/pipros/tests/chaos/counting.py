"""The resources of a process: memory, threads and descriptors, for tests of their release."""

import gc
import os
import threading
from dataclasses import dataclass
from pathlib import Path

from pipros.net.workers import KEPT_IDLE
from tests.support.waiting import wait_until

_MEMORY_SLACK_BYTES = 4 * 1024 * 1024
"""What the allocator may keep of its own accord."""


_KEPT_DESCRIPTORS = 4
"""The connections over which two nodes ask their master once a second, with both ends in this process."""


@dataclass(frozen=True, slots=True)
class Holdings:
    """Threads, open descriptors and resident bytes of this process.

    Idle service threads that are kept for later calls are not counted.
    """

    threads: int
    descriptors: int
    resident_bytes: int


def count() -> Holdings:
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    serving = max(0, sum(name.startswith("service of ") for name in names()) - KEPT_IDLE)
    others = sum(not name.startswith("service of ") for name in names())
    return Holdings(others + serving, len(os.listdir("/proc/self/fd")), pages * os.sysconf("SC_PAGE_SIZE"))


def wait_until_back(before: Holdings) -> None:
    """Wait until the process has no more resources than before.

    Raises:
        AssertionError: the process still has more resources at the end.
    """

    def is_back() -> bool:
        now = count()
        return (
            now.threads <= before.threads
            and now.descriptors <= before.descriptors + _KEPT_DESCRIPTORS
            and now.resident_bytes <= before.resident_bytes + _MEMORY_SLACK_BYTES
        )

    wait_until(is_back, what=lambda: f"{before} became {count()}; threads: {sorted(names())}")


def names() -> list[str]:
    return [thread.name for thread in threading.enumerate()]
