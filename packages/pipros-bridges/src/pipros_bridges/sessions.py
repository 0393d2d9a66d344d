"""Clients of a bridge: their sessions, their list, and which of them is dispensable."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from pipros_bridges.client import BridgeClient
from pipros_bridges.outbox import ClientTraffic


@dataclass(frozen=True, slots=True)
class ClientRow:
    """An entry in the client list.

    Attributes:
        since: time of the connection, in seconds since 1970.
        sent: traffic of all subscriptions, current and past.
        topics: traffic of the current subscriptions, keyed by the names that `Session.takes` returns.
        publishes: topics that the client publishes.
        received: number of messages of all kinds from the client, and their size in bytes.
        waiting_bytes: size of the data that has not been sent to the client yet.
    """

    number: int
    protocol: str
    address: str
    agent: str
    since: float
    sent: ClientTraffic
    topics: Mapping[str, ClientTraffic]
    publishes: Sequence[str]
    received: ClientTraffic
    waiting_bytes: int


class Session(Protocol):
    """A session with one client. For use in the event loop."""

    async def receive(self, data: str | bytes) -> None:
        """Handle a message.

        The next message is not read before this returns, so a client cannot flood the server.
        """

    @property
    def worked_s(self) -> float:
        """Processor time (s) that threads have spent on the client's messages so far."""

    def takes(self) -> Mapping[Hashable, str]:
        """Return the client's subscriptions: a mapping from outbox keys to names in the client list."""

    def sends(self) -> Sequence[str]:
        """Return the topics that the client publishes."""

    @property
    def is_unused(self) -> bool:
        """Whether the client has no subscriptions, publications, services or pending requests."""

    def close(self) -> None:
        """Release the client's resources after its connection has closed."""


class Handler(Protocol):
    """The server's side of one protocol: opens a session for each client."""

    def open(self, client: BridgeClient) -> Session:
        """Start a session for a client. Called in the event loop."""

    def is_login(self, first: str | bytes) -> bool:
        """Return whether a client's first message is a valid login in this protocol."""


def row_of(client: BridgeClient, session: Session, since: float) -> ClientRow:
    """Return a client's entry in the client list."""
    return ClientRow(
        client.number,
        client.protocol,
        client.address,
        client.agent,
        since,
        client.outbox.total,
        _by_name(session.takes(), client.outbox.traffic()),
        session.sends(),
        client.received,
        client.outbox.waiting_bytes,
    )


def _by_name(
    names: Mapping[Hashable, str], traffic: Mapping[Hashable, ClientTraffic]
) -> dict[str, ClientTraffic]:
    return {name: traffic.get(key, ClientTraffic()) for key, name in names.items()}


def dispensable_client(sessions: Mapping[BridgeClient, Session], newcomer: str) -> BridgeClient | None:
    """Return the client that has been silent longest, of those that may make room for a new client.

    The client is chosen from the unused clients (see `Session.is_unused`) or, if there are none, from the
    clients of an address that has more than half of all clients, unless the new client has the same address.
    """
    by_silence = sorted(sessions, key=lambda client: client.active_s)
    hosts = Counter(client.host for client in by_silence)
    host, count = hosts.most_common(1)[0]
    unused = [each for each in by_silence if sessions[each].is_unused]
    if not unused and 2 * count > len(by_silence) and host != newcomer:
        unused = [each for each in by_silence if each.host == host]
    return unused[0] if unused else None
