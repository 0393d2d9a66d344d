"""Log each warning about other members only once."""

from __future__ import annotations

import logging
from collections import Counter

from pipros.basics.printable import printable


class WarningsOnce:
    """Logs each distinct warning once, up to `limit` warnings; those of a member are half of the rest.

    The limit is necessary because other members can cause any number of warnings.
    """

    def __init__(self, log: logging.Logger, limit: int = 1000) -> None:
        self._log = log
        self._limit = limit
        self._reported: set[str] = set()
        self._counts: Counter[str] = Counter()

    def __call__(self, text: str, member: str = "") -> None:
        """Log a warning that a member has caused."""
        text = printable(text, 2000)  # it contains names and texts of other members
        own = self._counts[member]
        if text not in self._reported and 2 * own < self._limit - (len(self._reported) - own):
            self._counts[member] += 1
            self._reported.add(text)
            self._log.warning(text)
