"""Who is connected to a server, who has to leave for others, and who was refused what."""

from __future__ import annotations

import logging
from collections import OrderedDict
from typing import Final, Protocol

_log = logging.getLogger("pipros.rpc")

_PEERS_REMEMBERED: Final = 10_000


class Connection(Protocol):
    """What is asked of a connection here."""

    @property
    def peer(self) -> str:
        """The IP address of the other side."""

    @property
    def last_used(self) -> float:
        """When it was last of use, by the loop's clock."""

    def abort(self) -> None:
        """Closes at once."""


class Refusals:
    """Counts what peers are refused; writes the first refusal of each peer to the log."""

    def __init__(self) -> None:
        self.total = 0
        self._by_peer: dict[str, int] = {}

    def note(self, peer: str, text: str) -> None:
        self.total += 1
        count = self._by_peer.get(peer, 0)
        if not count:
            if len(self._by_peer) >= _PEERS_REMEMBERED:
                return
            _log.warning("refused %s: %s (its further refusals are counted only)", peer or "a peer", text)
        self._by_peer[peer] = count + 1

    def by_peer(self) -> dict[str, int]:
        return dict(self._by_peer)


class Connections:
    """The open connections of one server, the one idle longest first.

    When a new one exceeds a limit, the one that was idle longest is closed: the longest of the same
    peer when that peer has too many, else the longest of all. So new connections always get through,
    and whoever hoards idle ones loses them.
    """

    def __init__(self, *, limit: int, limit_per_peer: int, refusals: Refusals) -> None:
        self._limit = limit
        self._limit_per_peer = limit_per_peer
        self._refusals = refusals
        self._all: OrderedDict[Connection, None] = OrderedDict()
        self._by_peer: dict[str, OrderedDict[Connection, None]] = {}
        self._deadlines: OrderedDict[Connection, float] = OrderedDict()
        self.accepted = 0
        self.closed_for_room = 0

    def __len__(self) -> int:
        return len(self._all)

    def enter(self, connection: Connection) -> None:
        """Takes a new connection in, if need be in the place of another."""
        of_peer = self._by_peer.setdefault(connection.peer, OrderedDict())
        if len(of_peer) >= self._limit_per_peer:
            self._make_room(of_peer)
        elif len(self._all) >= self._limit:
            self._make_room(self._all)
        self.accepted += 1
        self._by_peer.setdefault(connection.peer, of_peer)[connection] = None
        self._all[connection] = None

    def leave(self, connection: Connection) -> None:
        """Strikes a connection out. Harmless when repeated."""
        self._all.pop(connection, None)
        self._deadlines.pop(connection, None)
        of_peer = self._by_peer.get(connection.peer)
        if of_peer is not None:
            of_peer.pop(connection, None)
            if not of_peer:
                del self._by_peer[connection.peer]

    def touch(self, connection: Connection) -> None:
        """The connection was of use just now: it is the last to give way."""
        if connection in self._all:
            self._all.move_to_end(connection)
            self._by_peer[connection.peer].move_to_end(connection)

    def expect_by(self, connection: Connection, deadline: float) -> None:
        """The connection has until `deadline` for something; one that it has already is not moved."""
        self._deadlines.setdefault(connection, deadline)

    def expect_nothing(self, connection: Connection) -> None:
        self._deadlines.pop(connection, None)

    def sweep(self, now: float, idle_s: float) -> None:
        """Closes who missed a deadline or was idle for too long. Takes time only for those it closes."""
        while self._deadlines:
            late, deadline = next(iter(self._deadlines.items()))
            if deadline > now:
                break
            self._refusals.note(late.peer, "too slow over a request, or over reading an answer")
            self._close(late)
        while self._all and (oldest := next(iter(self._all))).last_used < now - idle_s:
            self._close(oldest)

    def close_all(self) -> None:
        for connection in list(self._all):
            self._close(connection)

    def _make_room(self, candidates: OrderedDict[Connection, None]) -> None:
        connection = next(iter(candidates))
        self.closed_for_room += 1
        self._refusals.note(connection.peer, "too many connections; the one idle longest was closed")
        self._close(connection)

    def _close(self, connection: Connection) -> None:
        self.leave(connection)
        connection.abort()
