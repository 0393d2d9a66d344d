"""Log records at most once in a period, as roscpp's `ROS_WARN_THROTTLE` does."""

from __future__ import annotations

import logging
import time
from typing import Any


class Throttle:
    """Logs each format string at most once in `period_s`, regardless of the inserted values."""

    def __init__(self, log: logging.Logger, period_s: float) -> None:
        self._log, self._period_s = log, period_s
        self._logged_s: dict[str, float] = {}

    def warning(self, text: str, *values: Any) -> None:
        """Log a warning, unless its format string was logged within the period."""
        self._write(logging.WARNING, text, values)

    def error(self, text: str, *values: Any) -> None:
        """Log an error, unless its format string was logged within the period."""
        self._write(logging.ERROR, text, values)

    def _write(self, level: int, text: str, values: tuple[Any, ...]) -> None:
        now_s = time.monotonic()
        if now_s - self._logged_s.get(text, -self._period_s) >= self._period_s:
            self._logged_s[text] = now_s
            self._log.log(level, text, *values)
