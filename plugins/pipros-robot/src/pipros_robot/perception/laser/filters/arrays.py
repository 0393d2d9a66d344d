"""Filters over time for a scan's arrays: the median or mean of each beam over the last scans."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from pipros_robot.perception.extras import numpy as np
from pipros_robot.perception.laser.filters.base import InvalidFilter, ScanFilter
from pipros_robot.perception.laser.scan import Scan

if TYPE_CHECKING:
    from pipros_libraries.vision.extras import Array

OBSERVATIONS_LIMIT: Final = 10_000
"""Maximum number of scans that an array filter stores."""


def _median(rows: Array) -> Array:
    """Return the lower median of each column. As in the original, columns with NaN use Wirth's selection."""
    found: Array = np.sort(rows, axis=0)[(len(rows) - 1) // 2]
    for column in np.flatnonzero(np.isnan(rows).any(0)):
        found[column] = _selected(rows[:, column].tolist(), (len(rows) - 1) // 2)
    return found


def _selected(values: list[float], rank: int) -> float:
    """Return the value with the given rank by Wirth's selection.

    If some values are NaN, the result depends on the order of the values.
    """
    low, high = 0, len(values) - 1
    while low < high:
        pivot, left, right = values[rank], low, high
        while left <= right:
            while values[left] < pivot:
                left += 1
            while pivot < values[right]:
                right -= 1
            if left <= right:
                values[left], values[right] = values[right], values[left]
                left, right = left + 1, right - 1
        low = left if right < rank else low
        high = right if rank < left else high
    return values[rank]


def _mean(rows: Array) -> Array:
    with np.errstate(invalid="ignore"):
        found: Array = np.add.accumulate(rows, axis=0)[-1] / np.float32(len(rows))
    return found


_FUNCTIONS: Final[dict[str, Callable[[Array], Array]]] = {
    "MultiChannelMedianFilterFloat": _median,
    "MultiChannelMeanFilterFloat": _mean,
}


class ArrayChain:
    """A chain of filters over time for one array."""

    def __init__(self, owner: str, description: Any) -> None:
        """Create the filters from a description: a list of maps with `name`, `type` and `params`.

        Raises:
            InvalidFilter: the description is invalid.
        """
        if not isinstance(description, list):
            raise InvalidFilter(f"filter {owner}: a chain must be a list, got {description!r}")
        self._steps: list[tuple[Callable[[Array], Array], deque[Array]]] = []
        for each in description:
            package, _, kind = str(each.get("type") if isinstance(each, dict) else "").partition("/")
            if package not in ("filters", "laser_filters") or kind not in _FUNCTIONS:
                raise InvalidFilter(
                    f"filter {owner}: type must be filters/ followed by {' or '.join(_FUNCTIONS)}, "
                    f"got {each!r}"
                )
            params = each.get("params")
            count = params.get("number_of_observations") if isinstance(params, dict) else None
            if type(count) is not int or not 0 < count <= OBSERVATIONS_LIMIT:
                raise InvalidFilter(
                    f"filter {owner}: number_of_observations must be 1 to {OBSERVATIONS_LIMIT}, got {count!r}"
                )
            self._steps.append((_FUNCTIONS[kind], deque(maxlen=count)))

    def update(self, values: Array) -> Array:
        """Return the filtered array. If the length has changed, discard the previous arrays."""
        for function, memory in self._steps:
            if memory and len(memory[0]) != len(values):
                memory.clear()
            memory.append(values)
            values = function(np.array(memory))
        return values


class ArrayFilter(ScanFilter):
    """Applies one chain of filters over time to the ranges, and another chain to the intensities."""

    def read(self, params: Mapping[str, Any]) -> None:
        chains = params.get("range_filter_chain"), params.get("intensity_filter_chain")
        if chains == (None, None):
            raise InvalidFilter(
                f"filter {self.name}: range_filter_chain or intensity_filter_chain must be given"
            )
        self._ranges, self._intensities = (ArrayChain(self.name, each or []) for each in chains)

    def update(self, scan: Scan) -> Scan:
        return replace(
            scan,
            ranges=self._ranges.update(scan.ranges),
            intensities=self._intensities.update(scan.intensities),
        )


class MedianFilter(ArrayFilter):
    """Applies the same chain to the ranges and to the intensities. Deprecated."""

    def read(self, params: Mapping[str, Any]) -> None:
        chain = params.get("internal_filter")
        self._ranges, self._intensities = (ArrayChain(self.name, chain) for _ in range(2))
