"""The connections of a server: the open ones, which of them are closed for new ones, and refusals."""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol

from pipros.net.address import is_loopback
from pipros.printable import printable

_log = logging.getLogger("pipros.rpc")

_PEERS_REMEMBERED: Final = 10_000
_REPORT_EVERY_S: Final = 60.0


class Connection(Protocol):
    """The part of a connection that this module uses."""

    @property
    def peer(self) -> str:
        """The IP address of the other side."""

    @property
    def last_used(self) -> float:
        """When it was last used, by the clock of `sweep`."""

    def abort(self) -> None:
        """Closes at once."""


@dataclass(slots=True, eq=False)
class Seat:
    """Represents a connection that another object owns, for example a topic link."""

    peer: str
    close: Callable[[], object]
    last_used: float = 0.0

    def abort(self) -> None:
        self.close()


class Refusals:
    """Counts refusals. Logs the first one of each peer, and at intervals the number of further ones."""

    def __init__(self, log: logging.Logger = _log) -> None:
        self.total = 0
        self._log = log
        self._by_peer: dict[str, int] = {}
        self._unreported = 0
        self._reported_at = 0.0

    def count(self, peer: str, text: str) -> None:
        """Counts a refusal of `peer`; logs `text` if it is the first."""
        self.total += 1
        known = self._by_peer.get(peer, 0)
        if known or len(self._by_peer) < _PEERS_REMEMBERED:
            self._by_peer[peer] = known + 1
        if known or peer not in self._by_peer:
            self._unreported += 1
            return
        self._reported_at = time.monotonic()
        self._log.warning(
            "refused %s: %s (its further refusals are counted only)", peer or "a peer", printable(text)
        )

    def report(self) -> None:
        """Logs the number of refusals since the last report, at most once a minute."""
        now = time.monotonic()
        if self._unreported and now - self._reported_at >= _REPORT_EVERY_S:
            self._log.warning("refused %d more, of %d since the start", self._unreported, self.total)
            self._unreported, self._reported_at = 0, now

    def by_peer(self) -> dict[str, int]:
        return dict(self._by_peer)


@dataclass(slots=True)
class _Group:
    """Connections of one peer, or all.

    Attributes:
        idle: connections that may be closed for new ones, the longest idle first.
        links: connections in constant use, in the order in which they came.
        count: the number of all connections, including those of neither kind.
    """

    idle: OrderedDict[Connection, None] = field(default_factory=OrderedDict)
    links: OrderedDict[Connection, None] = field(default_factory=OrderedDict)
    count: int = 0

    def discard(self, connection: Connection) -> None:
        self.idle.pop(connection, None)
        self.links.pop(connection, None)
        self.count -= 1


class HeldBytes:
    """The bytes that a server holds for its peers: partial requests, and replies that peers do not read.

    Above the limit, the connection that began first is closed. For the server's thread only.
    """

    def __init__(self, *, limit_bytes: int, refusals: Refusals) -> None:
        self._limit_bytes = limit_bytes
        self._refusals = refusals
        self._held: dict[Connection, int] = {}  # in the order in which they began
        self.bytes = 0

    def note(self, connection: Connection, count: int) -> None:
        """Records the number of bytes held for a connection."""
        self.bytes += count - self._held.get(connection, 0)
        self._held[connection] = count
        while self.bytes > self._limit_bytes:
            oldest = next(iter(self._held))
            self.forget(oldest)
            self._refusals.count(
                oldest.peer, "too large a request, or an answer not read, beside those of others"
            )
            oldest.abort()

    def forget(self, connection: Connection) -> None:
        """Removes the bytes of a connection, after its request or its end. May be repeated."""
        self.bytes -= self._held.pop(connection, 0)


class Connections:
    """The open connections of one server, the longest idle first.

    When a new one exceeds a limit, the longest idle one is closed: that of the same
    peer when that peer has too many, else that of all. So new connections always succeed,
    and a peer that hoards idle ones loses them. Connections that are held (a call is being handled) and links
    are not closed for them. When only those are left, a new link replaces the newest link of the peer
    that has the most: links that are older than a flood of new ones stay. Links cannot take the last eighth.

    Thread-safe.
    """

    def __init__(
        self, *, limit: int, limit_per_peer: int, refusals: Refusals, spares_loopback: bool = False
    ) -> None:
        """`spares_loopback`: the limit per peer does not apply to loopback, which all local nodes share."""
        self._limit = limit
        self._limit_per_peer = limit_per_peer
        self._spares_loopback = spares_loopback
        self.refusals = refusals
        self._all = _Group()
        self._by_peer: dict[str, _Group] = {}
        self._members: set[Connection] = set()
        self._reserved = 0
        self._deadlines: OrderedDict[Connection, float] = OrderedDict()
        self._lock = threading.Lock()
        self.accepted = 0
        self.closed_for_room = 0

    def __len__(self) -> int:
        return self._all.count

    def enter(self, connection: Connection) -> bool:
        """Adds a new connection, if necessary in place of an idle one; False when all are in use."""
        return self._enter(connection, is_link=False)

    def enter_link(self, connection: Connection) -> bool:
        """As `enter`, for a connection that is in constant use from now on."""
        return self._enter(connection, is_link=True)

    def reserve(self, most: int) -> bool:
        """Counts a link that this node makes; False when it has made `most`, or the limit is reached.

        An eighth of the limit is reserved for links that peers make.
        """
        evicted: Connection | None = None
        with self._lock:
            if self._reserved >= min(most, self._limit - self._limit // 4):
                return False
            if len(self._all.links) + self._reserved >= self._limit - self._limit // 8:
                return False
            if self._all.count + self._reserved >= self._limit:
                evicted = self._pick_evicted(self._all, is_link=False)
                if evicted is None:
                    return False
                self._remove(evicted)
                self.closed_for_room += 1
            self._reserved += 1
        if evicted is not None:
            evicted.abort()
        return True

    def give_back(self) -> None:
        """Ends the reservation of a connection."""
        with self._lock:
            self._reserved -= 1

    def leave(self, connection: Connection) -> None:
        """Removes a connection. May be repeated."""
        with self._lock:
            self._remove(connection)

    def touch(self, connection: Connection) -> None:
        """Marks the connection as just used: it is the last to be closed for others, and no longer held."""
        with self._lock:
            if connection in self._members:
                for group in (self._all, self._by_peer[connection.peer]):
                    group.idle[connection] = None
                    group.idle.move_to_end(connection)

    def hold(self, connection: Connection) -> None:
        """Protects the connection from being closed for others or by a deadline, until `touch`."""
        with self._lock:
            self._deadlines.pop(connection, None)
            if connection in self._members:
                for group in (self._all, self._by_peer[connection.peer]):
                    group.idle.pop(connection, None)

    def expect_by(self, connection: Connection, deadline: float) -> None:
        """Sets a deadline for the connection, unless it has one already."""
        with self._lock:
            if connection in self._members:
                self._deadlines.setdefault(connection, deadline)

    def expect_nothing(self, connection: Connection) -> None:
        with self._lock:
            self._deadlines.pop(connection, None)

    def sweep(self, now: float, idle_s: float) -> None:
        """Closes connections that missed a deadline or were idle too long. Visits only those."""
        late: list[Connection] = []
        idle: list[Connection] = []
        with self._lock:
            while self._deadlines:
                slow, deadline = next(iter(self._deadlines.items()))
                if deadline > now:
                    break
                self._remove(slow)
                late.append(slow)
            while self._all.idle and (oldest := next(iter(self._all.idle))).last_used < now - idle_s:
                self._remove(oldest)
                idle.append(oldest)
        for connection in late:
            self.refusals.count(connection.peer, "too slow over a request, or over reading an answer")
        for connection in (*late, *idle):
            connection.abort()
        self.refusals.report()

    def close_all(self) -> None:
        with self._lock:
            members = list(self._members)
            for connection in members:
                self._remove(connection)
        for connection in members:
            connection.abort()

    def _enter(self, connection: Connection, *, is_link: bool) -> bool:
        evicted: Connection | None = None
        with self._lock:
            of_peer = self._by_peer.get(connection.peer)
            within: _Group | None = None
            if of_peer is not None and of_peer.count >= self._limit_of(connection.peer):
                within = of_peer
            elif is_link and len(self._all.links) + self._reserved >= self._limit - self._limit // 8:
                within = _Group(links=self._all.links)  # a part is reserved for calls
            elif self._all.count + self._reserved >= self._limit:
                within = self._all
            if within is not None and (evicted := self._pick_evicted(within, is_link=is_link)) is not None:
                self.closed_for_room += 1
                self._remove(evicted)
            has_room = within is None or evicted is not None
            if has_room:
                self.accepted += 1
                self._members.add(connection)
                for group in (self._all, self._by_peer.setdefault(connection.peer, _Group())):
                    group.count += 1
                    (group.links if is_link else group.idle)[connection] = None
        if evicted is not None:
            self.refusals.count(evicted.peer, "too many connections; the one idle longest was closed")
            evicted.abort()
        elif not has_room:
            self.refusals.count(connection.peer, "too many connections, and all are in use")
        return has_room

    def _limit_of(self, peer: str) -> int:
        return self._limit if self._spares_loopback and is_loopback(peer) else self._limit_per_peer

    def _pick_evicted(self, within: _Group, *, is_link: bool) -> Connection | None:
        if within.idle:
            return next(iter(within.idle))
        if not is_link:
            return None
        if within.links is self._all.links:
            within = max(self._by_peer.values(), key=lambda group: len(group.links), default=within)
        return next(reversed(within.links), None)

    def _remove(self, connection: Connection) -> None:
        self._deadlines.pop(connection, None)
        if connection in self._members:
            self._members.discard(connection)
            self._all.discard(connection)
            of_peer = self._by_peer[connection.peer]
            of_peer.discard(connection)
            if not of_peer.count:
                del self._by_peer[connection.peer]
