"""Warnings about other members, each logged once."""

from __future__ import annotations

import logging


class WarningsOnce:
    """Logs each text once. Other members choose parts of the texts, so their number is limited."""

    def __init__(self, log: logging.Logger, limit: int = 1000) -> None:
        self._log = log
        self._limit = limit
        self._reported: set[str] = set()

    def __call__(self, text: str) -> None:
        if text not in self._reported and len(self._reported) < self._limit:
            self._reported.add(text)
            self._log.warning(text)
