"""Submessages of datagrams (OMG DDSI-RTPS 2.3, section 9.4). `encoding` and `decoding` convert them.

They are NamedTuples, because they are created for every datagram, and frozen dataclasses take three times as
long.
"""

from __future__ import annotations

from typing import Final, NamedTuple, TypeAlias

from pipros_ros2.rtps.parameters import Parameters

Buffer: TypeAlias = "bytes | memoryview"

RTPS_HEADER_BYTES: Final = 20
MAX_SET: Final = 256
"""Maximum number of members of a set, counted from its base."""

MAGIC: Final = b"RTPS"
# The kinds of submessages, then their flags.
PAD, ACKNACK, HEARTBEAT, GAP, INFO_TS, INFO_SRC, INFO_DST = 0x01, 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0E
NACK_FRAG, HEARTBEAT_FRAG, DATA, DATA_FRAG = 0x12, 0x13, 0x15, 0x16
LITTLE, INLINE_QOS, HAS_DATA, HAS_KEY = 0x01, 0x02, 0x04, 0x08
FINAL: Final = 0x02


class Data(NamedTuple):
    """A sample.

    If `has_payload` is False, the sample announces that an instance has ended, and `payload` is the
    instance's key or empty.
    """

    reader: bytes
    writer: bytes
    sequence: int
    inline: Parameters | None
    payload: Buffer
    has_payload: bool = True


class DataFrag(NamedTuple):
    """Consecutive fragments of a sample. `first` is the number of the first one, counted from 1."""

    reader: bytes
    writer: bytes
    sequence: int
    first: int
    fragments: int
    fragment_bytes: int
    sample_bytes: int
    inline: Parameters | None
    payload: Buffer


class Heartbeat(NamedTuple):
    """The sequence numbers that a writer has; `last` is `first - 1` if it has none.

    `number` counts the writer's heartbeats. In other classes, `number` counts the submessages of that kind.
    """

    reader: bytes
    writer: bytes
    first: int
    last: int
    number: int
    is_final: bool


class AckNack(NamedTuple):
    """Acknowledgement of all samples below `base`, and a request for those in `missing`."""

    reader: bytes
    writer: bytes
    base: int
    missing: tuple[int, ...]
    number: int
    is_final: bool


class Gap(NamedTuple):
    """Samples that do not exist for this reader: those from `start` to `base - 1`, and those in `others`."""

    reader: bytes
    writer: bytes
    start: int
    base: int
    others: tuple[int, ...] = ()


class NackFrag(NamedTuple):
    """A request for fragments of a sample."""

    reader: bytes
    writer: bytes
    sequence: int
    missing: tuple[int, ...]
    number: int


class HeartbeatFrag(NamedTuple):
    """Announcement that a sample's fragments up to number `last` are available."""

    reader: bytes
    writer: bytes
    sequence: int
    last: int
    number: int


Submessage: TypeAlias = Data | DataFrag | Heartbeat | AckNack | Gap | NackFrag | HeartbeatFrag


class Datagram(NamedTuple):
    """The submessages for one participant in a datagram.

    Attributes:
        prefix, vendor: GUID prefix and vendor id of the sender.
        submessages: the submessages before the first malformed one.
        is_malformed: whether a submessage was malformed.
    """

    prefix: bytes
    vendor: bytes
    submessages: list[Submessage]
    is_malformed: bool
