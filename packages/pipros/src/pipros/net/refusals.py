"""Count the connections that a server refuses, and log them without filling the log."""

from __future__ import annotations

import logging
import time
from typing import Final

from pipros.basics.printable import printable

_log = logging.getLogger("pipros.rpc")

_PEERS_REMEMBERED: Final = 10_000
_REPORT_EVERY_S: Final = 60.0


class Refusals:
    """Counts refusals. Logs the first refusal of each peer, and the number of other refusals at intervals.

    The number of peers is limited: refusals of further peers are only counted.
    """

    def __init__(self, log: logging.Logger = _log, report_every_s: float = _REPORT_EVERY_S) -> None:
        self.total = 0
        self._log = log
        self._report_every_s = report_every_s
        self._by_peer: dict[str, int] = {}
        self._unreported = 0
        self._reported_at = 0.0

    def count(self, peer: str, text: str) -> None:
        """Count a refusal of `peer`. Log `text` if it is the peer's first refusal."""
        self.total += 1
        known = self._by_peer.get(peer, 0)
        if known or len(self._by_peer) < _PEERS_REMEMBERED:
            self._by_peer[peer] = known + 1
        if known or peer not in self._by_peer:
            self._unreported += 1
            return
        self._reported_at = time.monotonic()
        self._log.warning(
            "refused %s: %s (further refusals of this peer are only counted)",
            peer or "a peer",
            printable(text),
        )

    def report(self) -> None:
        """Log the number of refusals not logged individually, at most once every `report_every_s` seconds."""
        now = time.monotonic()
        if self._unreported and now - self._reported_at >= self._report_every_s:
            self._log.warning("%d more refusals, %d in total", self._unreported, self.total)
            self._unreported, self._reported_at = 0, now

    def by_peer(self) -> dict[str, int]:
        return dict(self._by_peer)
