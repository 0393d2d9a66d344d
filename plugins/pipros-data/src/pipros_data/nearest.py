"""Find the row of another table that matches each time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.msg.time import NS_PER_S

if TYPE_CHECKING:
    from numpy.typing import NDArray

DIRECTIONS = ("backward", "forward", "nearest")


def matches(
    times: NDArray[np.int64], others: NDArray[np.int64], tolerance: float | None, direction: str
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the index into `others` for each time, and a mask of the times without a match.

    The indices of masked times are undefined. `others` may be in any order. Of equal times in `others`, the
    last is used for an earlier match, and the first for a later match. For an exact match, the first is used
    if `direction` is `forward`, otherwise the last. For the arguments, see `Table.asof`.

    Raises:
        ValueError: the direction is unknown, or the tolerance is negative.
    """
    if direction not in DIRECTIONS:
        raise ValueError(f"direction must be one of {', '.join(DIRECTIONS)}, got {direction!r}")
    if tolerance is not None and not tolerance >= 0:
        raise ValueError(f"tolerance must be >= 0, got {tolerance}")
    if not len(others):
        return np.zeros(len(times), np.int64), np.ones(len(times), np.bool_)
    order = np.argsort(others, kind="stable")
    ordered = others[order]
    last = len(ordered) - 1
    before = np.searchsorted(ordered, times, "right") - 1
    after = np.searchsorted(ordered, times, "left")
    if direction == "nearest":
        distance_before = times - ordered[np.maximum(before, 0)]
        distance_after = ordered[np.minimum(after, last)] - times
        is_after = (before < 0) | ((after <= last) & (distance_after < distance_before))
        at: NDArray[Any] = np.where(is_after, after, before)
    else:
        at = before if direction == "backward" else after
    is_gap: NDArray[np.bool_] = (at < 0) | (at > last)
    at = np.clip(at, 0, last)
    if tolerance is not None:
        is_gap |= np.abs(ordered[at] - times) > round(tolerance * NS_PER_S)
    return order[at], is_gap
