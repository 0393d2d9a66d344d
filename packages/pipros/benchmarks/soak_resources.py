"""The resources of processes over time, for `soak_system.py`."""

from __future__ import annotations

import gc
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import psutil

FIFTHS = 5
#: The allowed growth of a process between the warm-up and the end.
MEMORY_SLACK_MB, THREADS_SLACK, FILES_SLACK = 6.0, 3, 5
#: The allowed growth of a browser, as a share: its memory and its threads vary.
BROWSER_SLACK = 0.1
#: A small heap may grow by this: the page keeps up to 100,000 log entries.
HEAP_SLACK_MB = 1.0
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")


@dataclass(slots=True)
class Held:
    """Resources, sample by sample. A list is empty if that resource is not sampled."""

    megabytes: list[float] = field(default_factory=list)
    threads: list[float] = field(default_factory=list)
    files: list[float] = field(default_factory=list)
    used_s: list[float] = field(default_factory=list)
    slack_mb: float = MEMORY_SLACK_MB

    def sample(self) -> None:
        """Record the current resources. They are 0 if the process has ended."""

    def add(self, one: list[float]) -> None:
        for values, value in zip((*self.resources, self.used_s), one, strict=True):
            values.append(value)

    @property
    def resources(self) -> tuple[list[float], list[float], list[float]]:
        return self.megabytes, self.threads, self.files

    def allowed(self) -> tuple[float, float, float]:
        """Return the allowed growth of memory, threads and descriptors."""
        return self.slack_mb, THREADS_SLACK, FILES_SLACK

    def growth(self) -> list[float]:
        """Return the growth of memory, threads and descriptors; 0 for resources that are not sampled."""
        # The maxima, because how many nodes are connected at a time depends on the load of the machine.
        most = [_growth(each, max) for each in (self.threads, self.files)]
        return [_growth(self.megabytes, statistics.median), *most]

    @property
    def is_flat(self) -> bool:
        return all(more <= most for more, most in zip(self.growth(), self.allowed(), strict=True))

    def cells(self, seconds: float) -> list[str]:
        """Return the cells of the table: each resource at the end, its growth, and the processor time.

        `seconds` is the time from the first to the last sample.
        """
        pairs = zip(self.resources, self.growth(), strict=True)
        cells = [f"{values[-1]:.1f} | {more:+.1f}" if values else " | " for values, more in pairs]
        used = self.used_s
        return [*cells, f"{100 * (used[-1] - used[0]) / seconds:.1f}" if len(used) > 1 else ""]


@dataclass(slots=True)
class Process(Held):
    """The resources of one process.

    Its children, such as the nodes of a launch, count only with their processor time, after they have ended.
    """

    pid: int = 0

    def sample(self) -> None:
        try:
            self.add(resources_of(psutil.Process(self.pid)))
        except psutil.Error:  # the process has ended
            self.add([0.0] * 4)


@dataclass(slots=True)
class Browser(Held):
    """The resources of all processes of Chromium. Memory that they share counts once."""

    def sample(self) -> None:
        found = [0.0] * 4
        for process in psutil.Process().children(recursive=True):
            try:
                if not process.name().startswith("chrom"):
                    continue
                one = resources_of(process)
                one[0] = process.memory_full_info().pss / (1 << 20)
            except psutil.Error:  # ended meanwhile
                continue
            found = [total + value for total, value in zip(found, one, strict=True)]
        self.add(found)

    def allowed(self) -> tuple[float, float, float]:
        megabytes, threads, files = (BROWSER_SLACK * statistics.median(each) for each in self.resources)
        return megabytes, threads, files


@dataclass(slots=True)
class Heap(Held):
    """The heap of a page's JavaScript after garbage collection. The client of the page appends the sizes.

    Attributes:
        history_mb: memory that the page may use to keep data that it shows.
    """

    history_mb: float = 0.0

    def growth(self) -> list[float]:
        # The minima, because the heap includes memory that is only in use briefly.
        return [_growth(self.megabytes, min), 0.0, 0.0]

    def allowed(self) -> tuple[float, float, float]:
        slack_mb = max(HEAP_SLACK_MB, BROWSER_SLACK * min(self.megabytes, default=0.0))
        return slack_mb + self.history_mb, 0.0, 0.0


def held() -> list[float]:
    """Return this process's megabytes, threads and descriptors after garbage collection."""
    gc.collect()
    return resources_of(psutil.Process())[:3]


def resources_of(process: psutil.Process) -> list[float]:
    """Return a process's megabytes, threads, descriptors, and processor time with its ended children."""
    used_s = sum(process.cpu_times()[:4])
    return [process.memory_info().rss / (1 << 20), process.num_threads(), process.num_fds(), used_s]


def _growth(values: list[float], middle: Callable[[list[float]], float]) -> float:
    """Return the growth of the middle from the second to the last fifth of the samples."""
    if not values:
        return 0.0
    size = max(1, len(values) // FIFTHS)
    return middle(values[-size:]) - middle(values[size : 2 * size] or values[:size])


class Processors:
    """The usage of all processors since this object was created, by this process tree and by others."""

    def __init__(self) -> None:
        self._began, self._own, self._busy = time.monotonic(), used_s(os.getpid()), _busy_s()

    def percent(self) -> tuple[float, float]:
        """Return the share of all processors used by this process and its descendants, and by others (%)."""
        available = (time.monotonic() - self._began) * (os.cpu_count() or 1)
        own, busy = used_s(os.getpid()) - self._own, _busy_s() - self._busy
        return 100 * own / available, max(0.0, 100 * (busy - own) / available)


def used_s(pid: int) -> float:
    """Return the processor time of a process and its descendants, including those that have ended."""
    root = psutil.Process(pid)
    total = 0.0
    for process in (root, *root.children(recursive=True)):
        try:
            total += sum(process.cpu_times()[:4])
        except psutil.NoSuchProcess:  # its time now counts for its parent
            continue
    return total


def _busy_s() -> float:
    ticks = list(map(int, Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]))
    return (sum(ticks) - ticks[3] - ticks[4]) / _TICKS_PER_S
