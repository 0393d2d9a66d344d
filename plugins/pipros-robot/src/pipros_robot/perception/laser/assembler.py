"""The memory of laser_assembler: the points of the last scans in a fixed frame, concatenated on request."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pipros_robot.perception.extras import numpy as np

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array


@dataclass(frozen=True, slots=True)
class StoredScan:
    """The points of a scan.

    Attributes:
        columns: float32 arrays by name: x, y, z, and the channels.
    """

    stamp_ns: int
    columns: dict[str, Array]


class Assembler:
    """Stores the last scans. Not thread-safe."""

    def __init__(self, size: int, step: int = 1) -> None:
        """Store the settings.

        Args:
            size: maximum number of scans.
            step: only every `step`-th scan and point is returned.
        """
        self._scans: deque[StoredScan] = deque(maxlen=size)
        self._step = max(step, 1)

    def add(self, scan: StoredScan) -> None:
        """Store a scan. If there are too many, drop the oldest."""
        self._scans.append(scan)

    def assembled(self, begin_ns: int, end_ns: int) -> StoredScan | None:
        """Return the points of the scans with begin <= time < end, or None if there are none.

        The result has the channels of the first scan, and the timestamp of the last scan. A channel that
        another scan lacks is filled with 0.
        """
        # The original stops at the first scan out of order, so one with a wrong timestamp hides all after it.
        used = [each for each in self._scans if begin_ns <= each.stamp_ns < end_ns][:: self._step]
        if not used:
            return None
        joined = {}
        for name in used[0].columns:
            parts = [each.columns.get(name, np.zeros_like(each.columns["x"])) for each in used]
            joined[name] = np.concatenate([part[:: self._step] for part in parts])
        return StoredScan(used[-1].stamp_ns, joined)
