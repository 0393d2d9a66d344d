"""The other participants: their leases, endpoints and addresses, within limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from pipros.basics.limits import Limits
from pipros.ros2.rtps.announcements import EndpointData, ParticipantData
from pipros.ros2.rtps.incomplete import Budget
from pipros.ros2.rtps.parameters import Address

MAX_LEASE_S: Final = 300.0
"""Upper bound for leases: with an infinite lease, a dead peer would stay forever."""
_OVERHEAD_BYTES: Final = 2_000
"""Memory of an announcement besides its bytes: objects, and the state of its connections."""


@dataclass(slots=True, eq=False)
class Peer:
    """Another participant.

    Attributes:
        host: address from which its first announcement was sent.
        found_at: time of its first announcement.
        heard_at: time of its last datagram.
        kept: budget for its announcements.
        incomplete: budget for its incomplete samples.
    """

    data: ParticipantData
    host: str
    found_at: float
    heard_at: float
    kept: Budget
    incomplete: Budget
    endpoints: dict[bytes, EndpointData] = field(default_factory=dict)
    is_over_limit: bool = False
    _costs: dict[bytes, int] = field(default_factory=dict)

    def keep(self, endpoint: EndpointData, payload: bytes) -> bool:
        """Add or replace an endpoint; return False if the limit is reached."""
        guid, cost = endpoint.guid, cost_bytes(payload)
        before = self._costs.get(guid, 0)
        if cost > before and not self.kept.take(cost - before):
            return False
        self.endpoints[guid] = endpoint
        self._costs[guid] = max(cost, before)
        return True

    def forget(self, guid: bytes) -> EndpointData | None:
        """Remove and return an endpoint; return None if it is unknown."""
        self.kept.give_back(self._costs.pop(guid, 0))
        return self.endpoints.pop(guid, None)

    @property
    def discovery_address(self) -> Address:
        return self.choose(self.data.discovery)

    def address_of(self, endpoint: EndpointData) -> Address:
        """Return the address for samples and requests to an endpoint of this peer."""
        return self.choose(endpoint.addresses or self.data.data)

    def choose(self, addresses: tuple[Address, ...]) -> Address:
        """Return the address that has the peer's `host`, or the first address if none has it."""
        return next((each for each in addresses if each.host == self.host), addresses[0])


def cost_bytes(payload: bytes) -> int:
    return len(payload) + _OVERHEAD_BYTES


class Peers:
    """All other participants that have announced themselves."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._kept = Budget(limits.ros2_discovery_bytes)
        self._incomplete = Budget(limits.ros2_incomplete_total_bytes)
        self._peers: dict[bytes, Peer] = {}

    def __iter__(self) -> Iterator[Peer]:
        return iter(self._peers.values())

    def __len__(self) -> int:
        return len(self._peers)

    def get(self, prefix: bytes) -> Peer | None:
        return self._peers.get(prefix)

    def add(self, data: ParticipantData, size: int, host: str, now: float) -> Peer | None:
        """Add and return a peer; return None if the limit is reached."""
        kept = Budget(self._limits.ros2_peer_bytes, self._kept)
        if not kept.take(size):
            return None
        incomplete = Budget(self._limits.ros2_incomplete_bytes, self._incomplete)
        peer = self._peers[data.prefix] = Peer(data, host, now, now, kept, incomplete)
        return peer

    def remove(self, prefix: bytes) -> Peer | None:
        peer = self._peers.pop(prefix, None)
        if peer is not None:
            peer.kept.give_back(peer.kept.used_bytes)
        return peer

    def expired(self, now: float) -> list[Peer]:
        """Return the peers that have been silent for longer than their lease."""
        return [peer for peer in self if now - peer.heard_at > min(peer.data.lease_s, MAX_LEASE_S)]
