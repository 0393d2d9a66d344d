"""Parameter lists (OMG DDSI-RTPS 2.3, section 9.4.2.11) in discovery announcements and inline QoS."""

from __future__ import annotations

import math
import socket
from enum import IntEnum
from struct import Struct, error
from typing import Final, NamedTuple, TypeAlias

Parameters: TypeAlias = "dict[int, list[bytes]]"
"""The encoded values of each parameter, in order, by parameter ID."""

_REQUIRED: Final = 0x4000
_HEADS = Struct(">HH"), Struct("<HH")
_INTEGERS = Struct(">I"), Struct("<I")
_DURATIONS = Struct(">iI"), Struct("<iI")
_SEQUENCE = Struct("<iI")
_LOCATORS = Struct(">iI"), Struct("<iI")
_UDP_V4: Final = 1
_INFINITE: Final = (0x7FFFFFFF, 0xFFFFFFFF)
_FRACTIONS: Final = 1 << 32


class Parameter(IntEnum):
    """Parameter IDs. 0x800f is Fast DDS's own ID for the related sample, which predates the standard's."""

    SENTINEL = 0x01
    LEASE_DURATION = 0x02
    TOPIC_NAME = 0x05
    TYPE_NAME = 0x07
    PROTOCOL_VERSION = 0x15
    VENDOR_ID = 0x16
    RELIABILITY = 0x1A
    LIVELINESS = 0x1B
    DURABILITY = 0x1D
    OWNERSHIP = 0x1F
    DEADLINE = 0x23
    PARTITION = 0x29
    USER_DATA = 0x2C
    UNICAST_LOCATOR = 0x2F
    DEFAULT_UNICAST_LOCATOR = 0x31
    META_UNICAST_LOCATOR = 0x32
    PARTICIPANT_GUID = 0x50
    BUILTIN_ENDPOINTS = 0x58
    ENDPOINT_GUID = 0x5A
    KEY_HASH = 0x70
    STATUS_INFO = 0x71
    DATA_REPRESENTATION = 0x73
    RELATED_SAMPLE = 0x83
    RELATED_SAMPLE_FAST = 0x800F


_MAX_VALUES: Final = 16
_MAX_PARAMETERS: Final = 512
"""Maximum number of parameters read from a list; further ones are ignored. ROS 2 sends about 30."""


class Address(NamedTuple):
    """An IPv4 address and a UDP port."""

    host: str
    port: int


class SampleIdentity(NamedTuple):
    """Writer and sequence number of a sample."""

    guid: bytes
    sequence: int


_KNOWN: Final = frozenset(each & ~_REQUIRED for each in Parameter)


def read_parameters(buffer: bytes | memoryview, position: int, *, is_little: bool) -> tuple[Parameters, int]:
    """Return the parameters that start at `position`, and the position after them.

    A truncated list ends after its last complete parameter. Unused parameters are left out, and so are a
    parameter's values beyond `_MAX_VALUES`, because a decoded value takes more memory than an encoded one.
    """
    head = _HEADS[is_little]
    found: Parameters = {}
    end = len(buffer)
    for _ in range(_MAX_PARAMETERS):
        if position + 4 > end:
            break
        name, length = head.unpack_from(buffer, position)
        position += 4
        if name == Parameter.SENTINEL:
            return found, position
        if position + length > end:
            break
        name &= ~_REQUIRED
        if name in _KNOWN:
            values = found.setdefault(name, [])
            if len(values) < _MAX_VALUES:
                values.append(bytes(buffer[position : position + length]))
        position += length
    return found, end


def read_parameter_list(payload: bytes | memoryview) -> tuple[Parameters, bool] | None:
    """Return the parameters of a payload, and whether they are little-endian.

    Return None if the payload is not a parameter list.
    """
    if len(payload) < 4 or payload[0] != 0 or payload[1] not in (2, 3):
        return None
    is_little = payload[1] == 3
    return read_parameters(payload, 4, is_little=is_little)[0], is_little


def parameter(name: Parameter, value: bytes) -> bytes:
    """Encode a parameter, with padding."""
    value += bytes(-len(value) % 4)
    return _HEADS[1].pack(name, len(value)) + value


SENTINEL: Final = _HEADS[1].pack(Parameter.SENTINEL, 0)
PARAMETER_LIST: Final = b"\x00\x03\x00\x00"
"""The encapsulation of a little-endian parameter list."""


def integer(value: int) -> bytes:
    return _INTEGERS[1].pack(value)


def read_integer(value: bytes, is_little: bool) -> int | None:
    return _INTEGERS[is_little].unpack_from(value)[0] if len(value) >= 4 else None


def duration(seconds: float) -> bytes:
    """Encode a duration in seconds; `math.inf` is encoded as DDS's infinite duration."""
    if math.isinf(seconds):
        return _DURATIONS[1].pack(*_INFINITE)
    whole = int(seconds)
    return _DURATIONS[1].pack(whole, int((seconds - whole) * _FRACTIONS))


def read_duration(value: bytes, is_little: bool) -> float | None:
    """Decode a duration in seconds; return None if it is negative or truncated."""
    if len(value) < 8:
        return None
    seconds, fraction = _DURATIONS[is_little].unpack_from(value)
    if (seconds, fraction) == _INFINITE:
        return math.inf
    return seconds + fraction / _FRACTIONS if seconds >= 0 else None


def text(value: str) -> bytes:
    """Encode a string."""
    encoded = value.encode() + b"\0"
    return _INTEGERS[1].pack(len(encoded)) + encoded


def read_text(value: bytes, is_little: bool) -> str | None:
    """Decode a string; return None if it is truncated or not UTF-8."""
    length = read_integer(value, is_little)
    if not length or 4 + length > len(value):
        return None
    try:
        return value[4 : 4 + length].rstrip(b"\0").decode()
    except UnicodeDecodeError:
        return None


def octets(value: bytes) -> bytes:
    """Encode a sequence of octets."""
    return _INTEGERS[1].pack(len(value)) + value


def read_octets(value: bytes, is_little: bool) -> bytes:
    """Decode a sequence of octets; return an empty one if it is truncated."""
    length = read_integer(value, is_little)
    return value[4 : 4 + length] if length and 4 + length <= len(value) else b""


def locator(address: Address) -> bytes:
    return _LOCATORS[1].pack(_UDP_V4, address.port) + bytes(12) + socket.inet_aton(address.host)


def read_locator(value: bytes, is_little: bool) -> Address | None:
    """Decode an address; return None for other transports and for addresses to which nothing can be sent."""
    if len(value) < 24:
        return None
    kind, port = _LOCATORS[is_little].unpack_from(value)
    if kind != _UDP_V4 or not 0 < port < 0x10000 or value[20:24] in (bytes(4), b"\xff\xff\xff\xff"):
        return None
    return Address(socket.inet_ntoa(value[20:24]), port)


def related_sample(identity: SampleIdentity) -> bytes:
    """Encode inline QoS that identifies a related sample, in the standard's parameter and in Fast DDS's.

    Fast DDS before 2.14 ignores the standard's parameter.
    """
    value = identity.guid + _SEQUENCE.pack(identity.sequence >> 32, identity.sequence & 0xFFFFFFFF)
    return (
        parameter(Parameter.RELATED_SAMPLE, value)
        + parameter(Parameter.RELATED_SAMPLE_FAST, value)
        + SENTINEL
    )


def read_related_sample(inline: Parameters | None) -> SampleIdentity | None:
    """Return the related sample that either parameter of inline QoS identifies, or None if there is none.

    The sequence number is read as little-endian: peers on big-endian machines are not supported.
    """
    if not inline:
        return None
    for name in (Parameter.RELATED_SAMPLE, Parameter.RELATED_SAMPLE_FAST):
        for value in inline.get(name, ()):
            try:
                high, low = _SEQUENCE.unpack_from(value, 16)
            except error:
                continue
            if any(value[:16]):
                return SampleIdentity(value[:16], (high << 32) | low)
    return None


STATUS_DISPOSED: Final = b"\0\0\0\x03"
"""Status of an entity that has ended: disposed and unregistered."""


def ended(guid: bytes) -> bytes:
    """Encode inline QoS that announces the end of a participant or endpoint."""
    return parameter(Parameter.KEY_HASH, guid) + parameter(Parameter.STATUS_INFO, STATUS_DISPOSED) + SENTINEL


def is_ended(inline: Parameters | None) -> bool:
    """Return True if inline QoS says that the entity was disposed or unregistered."""
    return any(len(value) >= 4 and value[3] & 3 for value in (inline or {}).get(Parameter.STATUS_INFO, ()))
