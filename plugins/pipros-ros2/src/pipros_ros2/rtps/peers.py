"""The other participants: their leases, endpoints and addresses, within limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from pipros.basics.budget import Budget
from pipros_ros2.rtps.announcements import EndpointData, ParticipantData
from pipros_ros2.rtps.parameters import Address

ROS2_DISCOVERY_BYTES = 32 * 1024 * 1024
"""Limit: all stored announcements of ROS 2 participants and endpoints. Beyond it, further ROS 2 participants
and endpoints are ignored; a participant can use at most half of the memory that other participants leave
free; of participants that do not answer, only the newest 500 are kept.
"""
ROS2_PEER_BYTES = 4 * 1024 * 1024
"""Limit: the stored announcements of one participant. Beyond it, further endpoints of the participant are
ignored, which is reported once.
"""
ROS2_INCOMPLETE_BYTES = 256 * 1024 * 1024
"""Limit: the fragments and early messages of one participant, until they are complete. Beyond it, fragments
are dropped, and requested again if the writer is reliable.
"""
ROS2_INCOMPLETE_TOTAL_BYTES = 512 * 1024 * 1024
"""Limit: the fragments and early messages of all participants together. Beyond it, fragments are dropped,
and requested again if the writer is reliable; a participant can use at most half of the memory that other
participants leave free.
"""

MAX_LEASE_S: Final = 300.0
"""Upper bound for leases: with an infinite lease, a dead peer would stay forever."""
_PART: Final = 0.5
_OVERHEAD_BYTES: Final = 2_000
"""Memory of an announcement besides its bytes: objects, and the state of its connections."""


_NOWHERE: Final = Address("127.0.0.1", 9)


@dataclass(slots=True, eq=False)
class Peer:
    """Another participant.

    Attributes:
        host: address from which its first announcement was sent.
        found_at: time of its first announcement.
        heard_at: time of its last datagram.
        kept: budget for its announcements.
        incomplete: budget for its incomplete samples.
        discovery_address: the address for endpoint announcements.
        hosts: addresses of this machine and of static peers; see `choose`.
    """

    data: ParticipantData
    host: str
    found_at: float
    heard_at: float
    kept: Budget
    incomplete: Budget
    endpoints: dict[bytes, EndpointData] = field(default_factory=dict)
    is_over_limit: bool = False
    hosts: frozenset[str] = frozenset()
    discovery_address: Address = _NOWHERE
    _costs: dict[bytes, int] = field(default_factory=dict)
    _cost: int = 0

    def keep(self, endpoint: EndpointData, payload: bytes) -> bool:
        """Add or replace an endpoint; return False if the limit is reached."""
        guid, cost = endpoint.guid, cost_bytes(payload)
        if not self.kept.hold(self._costs.get(guid, 0), cost):
            return False
        self.endpoints[guid] = endpoint
        self._costs[guid] = cost
        return True

    def renew(self, data: ParticipantData, payload: bytes | memoryview) -> bool:
        """Replace the peer's own announcement.

        Return False, and change nothing, if there is no room for the new announcement, or if it has no usable
        address.
        """
        cost, address = cost_bytes(payload), self.choose(data.discovery)
        if address is None or not self.kept.hold(self._cost, cost):
            return False
        self.data, self.discovery_address, self._cost = data, address, cost
        return True

    def forget(self, guid: bytes) -> EndpointData | None:
        """Remove and return an endpoint; return None if it is unknown."""
        self.kept.give_back(self._costs.pop(guid, 0))
        return self.endpoints.pop(guid, None)

    def address_of(self, endpoint: EndpointData) -> Address | None:
        """Return the address for samples and requests to an endpoint of this peer; see `choose`."""
        return self.choose(endpoint.addresses or self.data.data)

    def choose(self, addresses: tuple[Address, ...]) -> Address | None:
        """Return the address with the peer's `host`, otherwise the first to which data may be sent, or None.

        An announcement is small, but data can be large: an announcement that names another machine as the
        recipient could make this machine flood the recipient. Therefore, data is sent only to the host that
        sent the announcement, to `hosts`, and, unless that host is in `hosts`, to its network (the first
        three bytes of the address).
        """
        same_host = next((each for each in addresses if each.host == self.host), None)
        return same_host or next((each for each in addresses if self._is_near(each.host)), None)

    def _is_near(self, host: str) -> bool:
        if self.host in self.hosts or self.host.startswith("127."):
            return host in self.hosts or host.startswith("127.")
        return host in self.hosts or host.rpartition(".")[0] == self.host.rpartition(".")[0]


def cost_bytes(payload: bytes | memoryview) -> int:
    return len(payload) + _OVERHEAD_BYTES


class Peers:
    """All other participants that have announced themselves.

    Each may use at most half of the memory that the others leave, so that even a flood of participants leaves
    room for the next one.
    """

    def __init__(self, hosts: frozenset[str] = frozenset()) -> None:
        """Create an empty table. Data may be sent to `hosts`: this machine's addresses and static peers."""
        self._hosts = hosts
        self._kept = Budget(ROS2_DISCOVERY_BYTES)
        self._incomplete = Budget(ROS2_INCOMPLETE_TOTAL_BYTES)
        self._peers: dict[bytes, Peer] = {}

    def __iter__(self) -> Iterator[Peer]:
        return iter(self._peers.values())

    def __len__(self) -> int:
        return len(self._peers)

    def get(self, prefix: bytes) -> Peer | None:
        return self._peers.get(prefix)

    def reaches(self, data: ParticipantData, host: str) -> bool:
        """Return whether a participant, announced by a host, has an address to which data may be sent."""
        nothing = Budget(0)
        peer = Peer(data, host, 0, 0, nothing, nothing, hosts=self._hosts)
        return peer.choose(data.discovery) is not None

    def add(self, data: ParticipantData, payload: bytes | memoryview, host: str, now: float) -> Peer | None:
        """Add and return a peer; return None if the limit is reached or `data` contains no usable address."""
        kept = Budget(ROS2_PEER_BYTES, self._kept, part=_PART)
        incomplete = Budget(ROS2_INCOMPLETE_BYTES, self._incomplete, part=_PART)
        peer = Peer(data, host, now, now, kept, incomplete, hosts=self._hosts)
        if not peer.renew(data, payload):
            return None
        self._peers[data.prefix] = peer
        return peer

    def remove(self, prefix: bytes) -> Peer | None:
        peer = self._peers.pop(prefix, None)
        if peer is not None:
            peer.kept.close()
            peer.incomplete.close()
        return peer

    def expired(self, now: float) -> list[Peer]:
        """Return the peers that have been silent for longer than their lease."""
        return [peer for peer in self if now - peer.heard_at > min(peer.data.lease_s, MAX_LEASE_S)]
