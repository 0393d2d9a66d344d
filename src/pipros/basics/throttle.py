"""Log records at most once in a period, as roscpp's `ROS_WARN_THROTTLE` does."""

from __future__ import annotations

import logging
import time
from typing import Any


class Throttle:
    """Passes on the first warning or error, and then at most one in each `period_s`."""

    def __init__(self, log: logging.Logger, period_s: float) -> None:
        self._log, self._period_s = log, period_s
        self._last_s = -float("inf")

    def warning(self, text: str, *values: Any) -> None:
        """Log a warning unless another record was logged within the period."""
        self._write(logging.WARNING, text, values)

    def error(self, text: str, *values: Any) -> None:
        """Log an error unless another record was logged within the period."""
        self._write(logging.ERROR, text, values)

    def _write(self, level: int, text: str, values: tuple[Any, ...]) -> None:
        now_s = time.monotonic()
        if now_s - self._last_s >= self._period_s:
            self._last_s = now_s
            self._log.log(level, text, *values)
