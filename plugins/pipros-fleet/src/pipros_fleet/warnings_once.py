"""Log each warning about other members only once."""

from __future__ import annotations

import logging

from pipros.basics.printable import printable


class WarningsOnce:
    """Logs each distinct warning once, up to `limit` warnings.

    The limit is necessary because other members can cause any number of warnings.
    """

    def __init__(self, log: logging.Logger, limit: int = 1000) -> None:
        self._log = log
        self._limit = limit
        self._reported: set[str] = set()

    def __call__(self, text: str) -> None:
        text = printable(text, 2000)  # it contains names and texts of other members
        if text not in self._reported and len(self._reported) < self._limit:
            self._reported.add(text)
            self._log.warning(text)
