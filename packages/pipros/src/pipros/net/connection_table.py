"""A server's open connections, and the rules for closing some of them to make room for new connections."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Protocol

from pipros.net.address import is_loopback
from pipros.net.refusals import Refusals

WHOLE_REQUEST_S = 30.0
"""Limit: the time for an XML-RPC request to arrive, and for its sender to read the response; also for
service calls, for which it restarts after every MiB. Beyond it, the connection is closed.
"""
CHECK_S, CHECK_IDLE_S = 1.0, 5.0
"""Intervals of looking for such connections: while there are deadlines, and while there are none."""


class TableEntry(Protocol):
    """The attributes and methods of a connection that the table uses."""

    @property
    def peer(self) -> str:
        """The IP address of the other side."""

    @property
    def last_used(self) -> float:
        """The time at which the connection was last used, on the clock that `close_overdue` uses."""

    def abort(self) -> None:
        """Close the connection immediately."""


class LinkEntry:
    """A connection in the table that another object owns, such as a topic link."""

    __slots__ = ("close", "last_used", "peer")

    def __init__(self, peer: str, close: Callable[[], object], last_used: float = 0.0) -> None:
        self.peer = peer
        self.close = close
        self.last_used = last_used

    def abort(self) -> None:
        self.close()


class _Group:
    """The connections from one peer, or from all peers.

    Attributes:
        idle: connections that may be closed to make room for new connections, longest idle first.
        links: connections in constant use, oldest first.
        count: the number of all connections, including connections that are neither idle nor links.
    """

    def __init__(self) -> None:
        self.idle: OrderedDict[TableEntry, None] = OrderedDict()
        self.links: OrderedDict[TableEntry, None] = OrderedDict()
        self.count = 0

    def discard(self, connection: TableEntry) -> None:
        self.idle.pop(connection, None)
        self.links.pop(connection, None)
        self.count -= 1


class ConnectionTable:
    """One server's open connections, longest idle first.

    When a new connection exceeds a limit, the connection that has been idle longest is closed: a connection
    from the same peer if that peer has too many, otherwise a connection from any peer. A peer that hoards
    idle connections therefore loses them. Busy connections (those with a call in progress) are never closed
    to make room, and links only for new links. If no idle connection is left, or the limit on links is
    reached, a new link replaces the newest link of its peer, if that peer has too many connections, or of the
    peer with the most links. Older links therefore survive a flood of new links.

    Links cannot use up the limit, because an eighth is reserved for calls. Links that this node itself opens
    leave a quarter free: regardless of the number of its subscriptions, an eighth remains for peers' links,
    and an eighth for calls.

    Thread-safe.

    Attributes:
        refusals: the connections that were refused, closed for another connection, or overdue, by peer.
        accepted: number of connections added.
        evicted: number of connections closed to make room for new connections.
    """

    def __init__(
        self, *, limit: int, limit_per_peer: int, refusals: Refusals, spares_loopback: bool = False
    ) -> None:
        """Create an empty table.

        If `spares_loopback` is true, the limit per peer does not apply to loopback addresses, which all local
        nodes share.
        """
        self._limit = limit
        self._limit_per_peer = limit_per_peer
        self._links_limit = limit - limit // 8
        self._outgoing_limit = limit - limit // 4
        self._spares_loopback = spares_loopback
        self.refusals = refusals
        self._all = _Group()
        self._by_peer: dict[str, _Group] = {}
        self._members: set[TableEntry] = set()
        self._outgoing = 0
        self._deadlines: OrderedDict[TableEntry, float] = OrderedDict()
        self._lock = threading.Lock()
        self.accepted = 0
        self.evicted = 0

    def __len__(self) -> int:
        return self._all.count

    def add(self, connection: TableEntry) -> bool:
        """Add a connection, closing an idle connection if necessary. Return False if none can be closed."""
        return self._add(connection, is_link=False)

    def add_link(self, connection: TableEntry) -> bool:
        """Add a connection in constant use, closing an idle connection or another link if necessary.

        Return False if none can be closed.
        """
        return self._add(connection, is_link=True)

    def remove(self, connection: TableEntry) -> None:
        """Remove a connection. May be called repeatedly."""
        with self._lock:
            self._remove(connection)

    def reserve_outgoing(self, limit: int) -> bool:
        """Reserve a slot for a link that this node is about to open, closing an idle connection if necessary.

        Return False if the node already has `limit` such links, or if a limit of the table is reached.
        """
        evicted: TableEntry | None = None
        with self._lock:
            if self._outgoing >= min(limit, self._outgoing_limit) or self._are_links_full():
                return False
            if self._all.count + self._outgoing >= self._limit:
                evicted = self._pick_evicted(self._all, is_link=False)
                if evicted is None:
                    return False
                self._remove(evicted)
                self.evicted += 1
            self._outgoing += 1
        if evicted is not None:
            evicted.abort()
        return True

    def release_outgoing(self) -> None:
        """Release a slot reserved by `reserve_outgoing`."""
        with self._lock:
            self._outgoing -= 1

    def mark_used(self, connection: TableEntry) -> None:
        """Mark the connection as idle, and make it the last candidate for closing."""
        with self._lock:
            if connection in self._members:
                for group in (self._all, self._by_peer[connection.peer]):
                    group.idle[connection] = None
                    group.idle.move_to_end(connection)

    def mark_busy(self, connection: TableEntry) -> None:
        """Keep the connection open until `mark_used`, even if room is needed or a deadline passes."""
        with self._lock:
            self._deadlines.pop(connection, None)
            if connection in self._members:
                for group in (self._all, self._by_peer[connection.peer]):
                    group.idle.pop(connection, None)

    def set_deadline(self, connection: TableEntry, deadline: float) -> None:
        """Set the time by which the connection must make progress, unless it already has a deadline."""
        with self._lock:
            if connection in self._members:
                self._deadlines.setdefault(connection, deadline)

    def clear_deadline(self, connection: TableEntry) -> None:
        with self._lock:
            self._deadlines.pop(connection, None)

    def close_overdue(self, now: float, idle_s: float) -> float:
        """Close connections that missed a deadline or were idle for over `idle_s`, and report refusals.

        Return the interval in seconds to the next call: a server without deadlines wakes rarely.
        """
        late: list[TableEntry] = []
        idle: list[TableEntry] = []
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
            self.refusals.count(connection.peer, "took too long to send a request or to read a response")
        for connection in (*late, *idle):
            connection.abort()
        self.refusals.report()
        return CHECK_S if self._deadlines else CHECK_IDLE_S

    def close_all(self) -> None:
        with self._lock:
            members = list(self._members)
            for connection in members:
                self._remove(connection)
        for connection in members:
            connection.abort()

    def _add(self, connection: TableEntry, *, is_link: bool) -> bool:
        evicted: TableEntry | None = None
        was_idle = False
        with self._lock:
            of_peer = self._by_peer.get(connection.peer)
            within: _Group | None = None
            if of_peer is not None and of_peer.count >= self._limit_of(connection.peer):
                within = of_peer
            elif is_link and self._are_links_full():
                # closing an idle connection would not free a slot for a link
                within = _Group()
                within.links = self._all.links
            elif self._all.count + self._outgoing >= self._limit:
                within = self._all
            if within is not None and (evicted := self._pick_evicted(within, is_link=is_link)) is not None:
                was_idle = evicted in self._all.idle
                self.evicted += 1
                self._remove(evicted)
            is_added = within is None or evicted is not None
            if is_added:
                self.accepted += 1
                self._members.add(connection)
                for group in (self._all, self._by_peer.setdefault(connection.peer, _Group())):
                    group.count += 1
                    (group.links if is_link else group.idle)[connection] = None
        if evicted is not None:
            which = "the connection idle longest" if was_idle else "the newest link"
            self.refusals.count(evicted.peer, f"too many connections; {which} was closed to make room")
            evicted.abort()
        elif not is_added:
            self.refusals.count(connection.peer, "too many connections, and all are in use")
        return is_added

    def _are_links_full(self) -> bool:
        return len(self._all.links) + self._outgoing >= self._links_limit

    def _limit_of(self, peer: str) -> int:
        return self._limit if self._spares_loopback and is_loopback(peer) else self._limit_per_peer

    def _pick_evicted(self, within: _Group, *, is_link: bool) -> TableEntry | None:
        if within.idle:
            return next(iter(within.idle))
        if not is_link:
            return None
        if within.links is self._all.links:
            within = max(self._by_peer.values(), key=lambda group: len(group.links), default=within)
        return next(reversed(within.links), None)

    def _remove(self, connection: TableEntry) -> None:
        self._deadlines.pop(connection, None)
        if connection in self._members:
            self._members.discard(connection)
            self._all.discard(connection)
            of_peer = self._by_peer[connection.peer]
            of_peer.discard(connection)
            if not of_peer.count:
                del self._by_peer[connection.peer]
