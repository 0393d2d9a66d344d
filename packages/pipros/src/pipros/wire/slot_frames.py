"""Control frames for shared memory. They are sent between messages on a Unix stream that connects two nodes.

On such a stream, messages are shorter than 2**31 bytes, so a length with its highest bit set announces a
control frame of 28 bytes instead of a message:

    OFFER    the publisher can send segments; the subscriber replies with one byte in the stream once it can
             receive descriptors (until then it uses a plain `recv`, which is faster but closes them)
    SEGMENT  a new segment of slots of equal size; the segment's file descriptor arrives with the frame. The
             first SEGMENT also carries the write end of a pipe for acknowledgements
    SLOT     a slot of the newest segment contains a message of `second` bytes
    DROP     the segment is no longer used

A subscriber acknowledges each slot through the pipe, with eight bytes that say whether the slot is in use.
It reports a slot as in use before callbacks receive arrays that refer to the slot, and as free when nothing
refers to it any more. Segment numbers only increase, and each new segment replaces the previous one.
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

from pipros.basics.errors import ProtocolError

HEADER_FIELD: Final = "pipros_memory"
"""The field in a subscriber's connection header that indicates that the subscriber accepts these frames."""
ACCEPTED: Final = "slots"
"""The value of HEADER_FIELD."""

SEGMENT: Final = 1
SLOT: Final = 2
DROP: Final = 3
OFFER: Final = 4

READY: Final = b"\x01"
"""The reply to an OFFER."""

_CONTROL: Final = 0x8000_0000
_frame = struct.Struct("<IBxxxIQQ")
FRAME_BYTES: Final = _frame.size
LENGTH: Final = (FRAME_BYTES - 4) | _CONTROL
"""The length field of every control frame."""

_IN_USE: Final = 0x8000_0000
_acknowledgement = struct.Struct("<II")
ACKNOWLEDGEMENT_BYTES: Final = _acknowledgement.size

Slot = tuple[int, int]
"""The number of a segment, and the index of a slot in it."""


class ControlFrame(NamedTuple):
    """A control frame.

    Attributes:
        kind: `SEGMENT`, `SLOT`, `DROP` or `OFFER`.
        segment: the number of the segment; 0 in an OFFER.
        first: the size of each slot in bytes, or the index of a slot.
        second: the number of slots, or the size of a message.
    """

    kind: int
    segment: int
    first: int = 0
    second: int = 0


def encode(frame: ControlFrame) -> bytes:
    """Return a control frame in wire format.

    >>> len(encode(ControlFrame(DROP, 7))) == FRAME_BYTES
    True
    """
    return _frame.pack(LENGTH, *frame)


def decode(data: bytes | memoryview, offset: int = 0) -> ControlFrame:
    """Return the control frame at `offset`.

    Raises:
        ProtocolError: the kind of frame is unknown.

    >>> decode(encode(ControlFrame(SLOT, 7, 2, 1_000_000)))
    ControlFrame(kind=2, segment=7, first=2, second=1000000)
    """
    frame = ControlFrame(*_frame.unpack_from(data, offset)[1:])
    if frame.kind not in (SEGMENT, SLOT, DROP, OFFER):
        raise ProtocolError(f"control frame of unknown kind {frame.kind}")
    return frame


def encode_acknowledgement(slot: Slot, *, in_use: bool) -> bytes:
    """Return the acknowledgement of a slot in wire format. If `in_use` is False, the slot is free again."""
    segment, index = slot
    return _acknowledgement.pack(segment, index | _IN_USE if in_use else index)


def decode_acknowledgements(data: bytes) -> list[tuple[Slot, bool]]:
    """Return each acknowledged slot, and whether it is still in use.

    Raises:
        ProtocolError: the last acknowledgement is incomplete.

    >>> decode_acknowledgements(encode_acknowledgement((7, 2), in_use=True))
    [((7, 2), True)]
    """
    if len(data) % ACKNOWLEDGEMENT_BYTES:
        raise ProtocolError(f"acknowledgements take a multiple of 8 bytes, got {len(data)}")
    return [
        ((segment, index & ~_IN_USE), bool(index & _IN_USE))
        for segment, index in _acknowledgement.iter_unpack(data)
    ]
