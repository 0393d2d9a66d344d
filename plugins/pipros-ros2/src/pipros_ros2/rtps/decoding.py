"""Decoding of datagrams into submessages (OMG DDSI-RTPS 2.3, section 9.4). `encoding` does the reverse.

`read_datagram` never raises: it returns the submessages before the first malformed one. Both byte orders are
supported.
"""

from __future__ import annotations

from collections.abc import Callable
from struct import Struct, error
from typing import Final

from pipros_ros2.rtps.identity import PROTOCOL_VERSION
from pipros_ros2.rtps.parameters import Parameters, read_parameters
from pipros_ros2.rtps.submessages import (
    ACKNACK,
    DATA,
    DATA_FRAG,
    FINAL,
    GAP,
    HAS_DATA,
    HAS_KEY,
    HEARTBEAT,
    HEARTBEAT_FRAG,
    INFO_DST,
    INFO_SRC,
    INFO_TS,
    INLINE_QOS,
    LITTLE,
    MAGIC,
    MAX_SET,
    NACK_FRAG,
    PAD,
    RTPS_HEADER_BYTES,
    AckNack,
    Data,
    DataFrag,
    Datagram,
    Gap,
    Heartbeat,
    HeartbeatFrag,
    NackFrag,
    Submessage,
)

_MAX_SEQUENCE: Final = 1 << 62
"""No writer reaches larger numbers, and adding 1 to them could cause an overflow."""


def _both(layout: str) -> tuple[Struct, Struct]:
    """Return a layout for each byte order, indexed by the flag `LITTLE`."""
    return Struct(">" + layout), Struct("<" + layout)


_LENGTH = _both("H")
_WORDS = _both("I")
_DATA_LAYOUT = _both("HH4s4siI")
_FRAG_LAYOUT = _both("HH4s4siIIHHI")
_HEARTBEAT_LAYOUT = _both("4s4siIiIi")
_HEARTBEAT_FRAG_LAYOUT = _both("4s4siIIi")
_ACKNACK_LAYOUT = _both("4s4s")
_GAP_LAYOUT = _both("4s4siI")
_SET_LAYOUT = _both("iII")
_NACK_FRAG_LAYOUT = _both("4s4siI")
_FRAG_SET_LAYOUT = _both("II")
_COUNT = _both("i")


class MalformedDatagram(Exception):
    """A submessage contradicts itself or is truncated."""


def read_datagram(datagram: bytes, own_prefix: bytes) -> Datagram | None:
    """Return the submessages for a participant, or None if the datagram is not RTPS 2.

    INFO_SRC, which only relays send, attributes the submessages after it to another participant. These
    submessages are left out.
    """
    if len(datagram) < RTPS_HEADER_BYTES or datagram[:4] != MAGIC or datagram[4] != PROTOCOL_VERSION[0]:
        return None
    prefix = datagram[8:20]
    found = Datagram(prefix, datagram[6:8], [], False)
    view = memoryview(datagram)
    position, end = RTPS_HEADER_BYTES, len(datagram)
    is_ours = True
    while position + 4 <= end:
        kind, flags = datagram[position], datagram[position + 1]
        length = _LENGTH[flags & LITTLE].unpack_from(datagram, position + 2)[0]
        position += 4
        if length == 0 and kind not in (PAD, INFO_TS):  # the last submessage extends to the end
            length = end - position
        if position + length > end:
            return found._replace(is_malformed=True)
        body = view[position : position + length]
        position += length
        if kind == INFO_DST:
            destination = bytes(body[:12])
            is_ours = destination == own_prefix or destination == bytes(12)
        elif kind == INFO_SRC:
            break
        elif is_ours and (read := _READERS.get(kind)) is not None:
            try:
                found.submessages.append(read(body, flags))
            except (MalformedDatagram, error):
                return found._replace(is_malformed=True)
    return found


def _sequence(high: int, low: int) -> int:
    number: int = (high << 32) | low
    if not 0 < number <= _MAX_SEQUENCE:
        raise MalformedDatagram
    return number


def _payload(
    body: memoryview, flags: int, to_inline: int, fixed_bytes: int
) -> tuple[Parameters | None, memoryview]:
    position = 4 + to_inline
    if not fixed_bytes <= position <= len(body):
        raise MalformedDatagram
    inline = None
    if flags & INLINE_QOS:
        inline, position = read_parameters(body, position, is_little=bool(flags & LITTLE))
    return inline, body[position:]


def _read_data(body: memoryview, flags: int) -> Data:
    layout = _DATA_LAYOUT[flags & LITTLE]
    _, to_inline, reader, writer, high, low = layout.unpack_from(body)
    inline, payload = _payload(body, flags, to_inline, layout.size)
    has_payload = bool(flags & HAS_DATA)
    if not flags & (HAS_DATA | HAS_KEY):
        payload = payload[:0]
    return Data(reader, writer, _sequence(high, low), inline, payload, has_payload)


def _read_data_frag(body: memoryview, flags: int) -> DataFrag:
    layout = _FRAG_LAYOUT[flags & LITTLE]
    fields = layout.unpack_from(body)
    _, to_inline, reader, writer, high, low, first, count, fragment_bytes, sample_bytes = fields
    inline, payload = _payload(body, flags, to_inline, layout.size)
    if not (first and count and fragment_bytes and sample_bytes):
        raise MalformedDatagram
    start = (first - 1) * fragment_bytes
    size = min(count * fragment_bytes, sample_bytes - start)
    if start >= sample_bytes or len(payload) < size:
        raise MalformedDatagram
    return DataFrag(
        reader,
        writer,
        _sequence(high, low),
        first,
        count,
        fragment_bytes,
        sample_bytes,
        inline,
        payload[:size],
    )


def _read_heartbeat(body: memoryview, flags: int) -> Heartbeat:
    reader, writer, *numbers = _HEARTBEAT_LAYOUT[flags & LITTLE].unpack_from(body)
    high, low, last_high, last_low, count = numbers
    first, last = _sequence(high, low), (last_high << 32) | last_low
    if not first - 1 <= last <= _MAX_SEQUENCE:
        raise MalformedDatagram
    return Heartbeat(reader, writer, first, last, count, bool(flags & FINAL))


def _members(
    body: memoryview, position: int, base: int, size: int, flags: int
) -> tuple[tuple[int, ...], int]:
    """Return the members of a set, from its bitmap of `size` bits, and the position after it."""
    if size > MAX_SET:
        raise MalformedDatagram
    members: list[int] = []
    for start in range(0, size, 32):
        word = _WORDS[flags & LITTLE].unpack_from(body, position)[0]
        position += 4
        if word:
            bits = range(min(32, size - start))
            members += [base + start + bit for bit in bits if word >> (31 - bit) & 1]
    return tuple(members), position


def _sequence_set(body: memoryview, position: int, flags: int) -> tuple[int, tuple[int, ...], int]:
    layout = _SET_LAYOUT[flags & LITTLE]
    high, low, size = layout.unpack_from(body, position)
    base = (high << 32) | low
    # Fast DDS and Cyclone DDS may send a base of 0 if the set is empty.
    if not 0 <= base <= _MAX_SEQUENCE - MAX_SET or (base == 0 and size):
        raise MalformedDatagram
    members, position = _members(body, position + layout.size, base, size, flags)
    return base, members, position


def _read_acknack(body: memoryview, flags: int) -> AckNack:
    layout = _ACKNACK_LAYOUT[flags & LITTLE]
    reader, writer = layout.unpack_from(body)
    base, missing, position = _sequence_set(body, layout.size, flags)
    count = _COUNT[flags & LITTLE].unpack_from(body, position)[0]
    return AckNack(reader, writer, base, missing, count, bool(flags & FINAL))


def _read_gap(body: memoryview, flags: int) -> Gap:
    layout = _GAP_LAYOUT[flags & LITTLE]
    reader, writer, high, low = layout.unpack_from(body)
    base, others, _ = _sequence_set(body, layout.size, flags)
    return Gap(reader, writer, _sequence(high, low), base, others)


def _read_nack_frag(body: memoryview, flags: int) -> NackFrag:
    layout, set_layout = _NACK_FRAG_LAYOUT[flags & LITTLE], _FRAG_SET_LAYOUT[flags & LITTLE]
    reader, writer, high, low = layout.unpack_from(body)
    base, size = set_layout.unpack_from(body, layout.size)
    if not base:
        raise MalformedDatagram
    missing, position = _members(body, layout.size + set_layout.size, base, size, flags)
    count = _COUNT[flags & LITTLE].unpack_from(body, position)[0]
    return NackFrag(reader, writer, _sequence(high, low), missing, count)


def _read_heartbeat_frag(body: memoryview, flags: int) -> HeartbeatFrag:
    reader, writer, high, low, last, count = _HEARTBEAT_FRAG_LAYOUT[flags & LITTLE].unpack_from(body)
    return HeartbeatFrag(reader, writer, _sequence(high, low), last, count)


_READERS: Final[dict[int, Callable[[memoryview, int], Submessage]]] = {
    DATA: _read_data,
    DATA_FRAG: _read_data_frag,
    HEARTBEAT: _read_heartbeat,
    ACKNACK: _read_acknack,
    GAP: _read_gap,
    NACK_FRAG: _read_nack_frag,
    HEARTBEAT_FRAG: _read_heartbeat_frag,
}
