"""Settings of a participant, and the events that it reports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from pipros_ros2.rtps.announcements import EndpointData, ParticipantData
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.qos import QosPolicy
from pipros_ros2.rtps.reader import REQUEST_BYTES
from pipros_ros2.rtps.writer_proxy import RtpsSample


@dataclass(frozen=True, slots=True)
class RtpsSettings:
    """Settings of a participant: its identity, and where it looks for other participants.

    Attributes:
        me: its own announcement.
        announce_to: addresses for announcements, in addition to known peers: a multicast group or hosts.
        local_hosts: this machine's addresses; peers with these addresses receive larger datagrams.
        request_bytes: maximum number of bytes to request from a writer at a time.
        static_hosts: addresses of static peers. Data may be sent to them regardless of who announced them.
    """

    me: ParticipantData
    announce_to: tuple[Address, ...]
    local_hosts: frozenset[str]
    request_bytes: int = REQUEST_BYTES
    static_hosts: frozenset[str] = frozenset()


class ReceivedSample(NamedTuple):
    """A sample for a local reader."""

    entity: bytes
    sample: RtpsSample


class Matched(NamedTuple):
    """A local and a remote endpoint have matched or, if `is_matched` is False, no longer match."""

    entity: bytes
    remote: EndpointData
    is_matched: bool


class Mismatched(NamedTuple):
    """A remote endpoint has the topic of a local endpoint, but does not match it.

    `policy` is the incompatible policy, or None if the types differ.
    """

    entity: bytes
    remote: EndpointData
    policy: QosPolicy | None


class EndpointChanged(NamedTuple):
    """A remote endpoint was announced or, if `is_present` is False, removed."""

    remote: EndpointData
    is_present: bool


class PeerChanged(NamedTuple):
    """Another participant was found or, if `is_present` is False, has left."""

    peer: ParticipantData
    is_present: bool


class OverLimit(NamedTuple):
    """Further endpoints of a participant are ignored, because it has reached the limit."""

    prefix: bytes


class Elsewhere(NamedTuple):
    """A participant or endpoint is ignored, because all its addresses are in other networks; see `Peer`."""

    prefix: bytes
    host: str


Event: TypeAlias = (
    ReceivedSample | Matched | Mismatched | EndpointChanged | PeerChanged | OverLimit | Elsewhere
)
