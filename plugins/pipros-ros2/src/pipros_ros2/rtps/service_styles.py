"""Service requests and replies in the styles of rmw_fastrtps and rmw_cyclonedds.

In the style of rmw_fastrtps, inline QoS refers to a related sample: in a request, to the client's reply
reader, and in a reply, to the request. In the style of rmw_cyclonedds, 16 bytes precede the message: a client
number and a sequence number, which the reply repeats. A peer that receives the other style misreads it, and
may run out of memory. Therefore, the style is chosen for each peer, and nothing is sent to peers of unknown
style.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from struct import Struct, error
from typing import Final

from pipros_ros2.rtps.announcements import EndpointData, ParticipantData, entries
from pipros_ros2.rtps.identity import CYCLONE_DDS, FAST_DDS
from pipros_ros2.rtps.parameters import SampleIdentity, read_related_sample
from pipros_ros2.rtps.writer_proxy import RtpsSample

PIPROS_MARK: Final = "pipros"
"""Name of the entry in USER_DATA that marks pipros participants."""

_ENCAPSULATION_BYTES: Final = 4
_CYCLONE_HEAD = Struct("<Qq")
_CLIENT_ID, _SERVICE_ID = "clientid", "serviceid"


class Style(Enum):
    """Method by which a peer relates replies to requests."""

    FAST = "rmw_fastrtps"
    CYCLONE = "rmw_cyclonedds"


def style_of(peer: ParticipantData, endpoint: EndpointData) -> Style | None:
    """Return the style implied by a peer's vendor or by the ids in USER_DATA, or None if it is unknown."""
    if PIPROS_MARK in entries(peer.user_data) or peer.vendor == FAST_DDS:
        return Style.FAST
    if peer.vendor == CYCLONE_DDS or entries(endpoint.user_data).keys() & {_CLIENT_ID, _SERVICE_ID}:
        return Style.CYCLONE
    return None


def endpoint_id(user_data: bytes) -> str | None:
    """Return the id that the two endpoints of a client or server share in the style of rmw_cyclonedds."""
    found = entries(user_data)
    return found.get(_CLIENT_ID) or found.get(_SERVICE_ID)


def id_entry(guid: bytes, *, is_client: bool) -> bytes:
    """Return a USER_DATA entry with an id for `endpoint_id`.

    >>> id_entry(bytes(range(16)), is_client=True)
    b'clientid=0.1.2.3.4.5.6.7.8.9.a.b.c.d.e.f;'
    """
    name = _CLIENT_ID if is_client else _SERVICE_ID
    return f"{name}={'.'.join(f'{byte:x}' for byte in guid)};".encode()


def topics_of(service: str) -> tuple[str, str]:
    """Return a service's request topic and reply topic in DDS.

    >>> topics_of("/add_two_ints")
    ('rq/add_two_intsRequest', 'rr/add_two_intsReply')
    """
    return f"rq{service}Request", f"rr{service}Reply"


@dataclass(frozen=True, slots=True)
class ServiceRequest:
    """A request to a server.

    Attributes:
        payload: CDR without `head`.
        writer: the client's request writer.
        reply_reader: the client's reply reader, if the request specifies it.
        related: the sample to which the reply must refer (rmw_fastrtps).
        head: the 16 bytes that the reply must repeat (rmw_cyclonedds).
    """

    payload: bytes
    writer: bytes
    style: Style
    reply_reader: bytes | None = None
    related: SampleIdentity | None = None
    head: bytes = b""

    def reply(self, payload: bytes) -> bytes:
        """Return the payload of a reply in the style of the request."""
        return with_head(payload, self.head) if self.head else payload


def with_head(payload: bytes, head: bytes) -> bytes:
    return payload[:_ENCAPSULATION_BYTES] + head + payload[_ENCAPSULATION_BYTES:]


def read_request(sample: RtpsSample, style: Style) -> ServiceRequest | None:
    """Return a request, or None if it is malformed, or refers to another participant's reader."""
    if style is Style.CYCLONE:
        found = split_head(sample.payload)
        if found is None:
            return None
        head, payload = found
        return ServiceRequest(payload, sample.writer, style, head=head)
    related = read_related_sample(sample.inline)
    if related is None:
        identity = SampleIdentity(sample.writer, sample.sequence)
        return ServiceRequest(sample.payload, sample.writer, style, related=identity)
    if related.guid[:12] != sample.writer[:12]:
        return None
    identity = SampleIdentity(related.guid, sample.sequence)
    return ServiceRequest(sample.payload, sample.writer, style, related.guid, identity)


def split_head(payload: bytes) -> tuple[bytes, bytes] | None:
    """Split off rmw_cyclonedds's 16 bytes from a payload. Return None if it is too short or big-endian."""
    end = _ENCAPSULATION_BYTES + _CYCLONE_HEAD.size
    if len(payload) < end or payload[1] & 1 == 0:
        return None
    return payload[_ENCAPSULATION_BYTES:end], payload[:_ENCAPSULATION_BYTES] + payload[end:]


def cyclone_head(client: int, number: int) -> bytes:
    return _CYCLONE_HEAD.pack(client, number)


def read_cyclone_head(head: bytes) -> tuple[int, int] | None:
    """Return the client number and the sequence number, or None if `head` does not have exactly 16 bytes."""
    try:
        client, number = _CYCLONE_HEAD.unpack(head)
    except error:
        return None
    return client, number
