"""Rate-limited warnings about peers."""

from __future__ import annotations

import logging
from typing import Final

from pipros.net.loop import BackgroundLoop

FULL: Final = 3
REPORT_S: Final = 10.0
"""At the start and after each report, the next FULL warnings are logged in full. Further warnings are only
counted until the next report, at most REPORT_S later.
"""


class ThrottledWarnings:
    """Decides which warnings are logged in full. For the event loop only.

    For suppressed warnings, only their number and the last subject are logged.
    """

    def __init__(self, log: logging.Logger, loop: BackgroundLoop, more: str) -> None:
        """Store the arguments.

        `more` is the message that reports suppressed warnings: `%d` is their number, `%s` the last subject.
        """
        self._log = log
        self._loop = loop
        self._more = more
        self._left = FULL
        self._suppressed = 0
        self._last = ""
        self._is_reporting = False

    def should_log(self, last: str) -> bool:
        """Return whether to log a warning in full; if not, count it. `last` is the warning's subject."""
        if not self._is_reporting:
            self._is_reporting = True
            self._loop.asyncio.call_later(REPORT_S, self._report)
        if self._left:
            self._left -= 1
            return True
        self._suppressed += 1
        self._last = last
        return False

    def _report(self) -> None:
        self._is_reporting = False
        self._left = FULL
        if self._suppressed:
            self._log.warning(self._more, self._suppressed, self._last)
            self._suppressed = 0
