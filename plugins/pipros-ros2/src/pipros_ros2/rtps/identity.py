"""Identifiers of participants and endpoints on the wire.

A GUID consists of its participant's prefix (12 bytes) and the entity's ID within the participant (4 bytes).
GUIDs and prefixes are `bytes` objects, because they are looked up for every datagram.
"""

from __future__ import annotations

import os
from typing import Final

PROTOCOL_VERSION: Final = b"\x02\x03"
OWN_VENDOR: Final = b"\x00\x00"
"""Unknown vendor: pipros has no registered id. Fast DDS and Cyclone DDS accept it."""
FAST_DDS: Final = b"\x01\x0f"
CYCLONE_DDS: Final = b"\x01\x10"

UNKNOWN_ENTITY: Final = b"\0\0\0\0"
PARTICIPANT_ENTITY: Final = b"\0\0\x01\xc1"
PARTICIPANT_WRITER: Final = b"\0\x01\0\xc2"
PARTICIPANT_READER: Final = b"\0\x01\0\xc7"
PUBLICATIONS_WRITER: Final = b"\0\0\x03\xc2"
PUBLICATIONS_READER: Final = b"\0\0\x03\xc7"
SUBSCRIPTIONS_WRITER: Final = b"\0\0\x04\xc2"
SUBSCRIPTIONS_READER: Final = b"\0\0\x04\xc7"

_WRITER_KIND: Final = 0x03
_READER_KIND: Final = 0x04
_WRITER_KINDS: Final = (0x02, _WRITER_KIND)
_PREFIX_BYTES: Final = 12
GUID_BYTES: Final = 16


def new_prefix() -> bytes:
    """Return a random prefix for a participant."""
    return OWN_VENDOR + os.urandom(_PREFIX_BYTES - len(OWN_VENDOR))


def user_entity(number: int, *, is_writer: bool) -> bytes:
    """Return the ID of a writer or reader without a key; all ROS 2 endpoints are of this kind."""
    return number.to_bytes(3, "big") + bytes([_WRITER_KIND if is_writer else _READER_KIND])


def is_writer(guid: bytes) -> bool:
    """Return True if a GUID's last byte marks a writer."""
    return guid[-1] & 0x3F in _WRITER_KINDS


def guid_text(guid: bytes) -> str:
    """Return a GUID as text.

    >>> guid_text(bytes(range(16)))
    '000102030405060708090a0b.0c0d0e0f'
    """
    return f"{guid[:_PREFIX_BYTES].hex()}.{guid[_PREFIX_BYTES:].hex()}"
