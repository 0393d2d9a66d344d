"""SNTP requests and responses (RFC 4330), to measure the offset of a clock. This module performs no I/O.

ntplib 0.4 (14 kB) is not used: it opens its own socket, accepts any packet from the server's address as the
response, and leaves it to the caller to check that the server's clock is synchronized.
"""

from __future__ import annotations

import struct

from pipros_libraries.diagnostics.machine import BadReading

PORT = 123

_TO_1900_S = 2_208_988_800
_ANSWER = struct.Struct(">BBbb11I")
_SERVER = 4


def question(now_s: float) -> bytes:
    """Return the request to send at `now_s` (seconds since 1970)."""
    seconds, fraction = _stamp(now_s)
    return struct.pack(">B39xII", 4 << 3 | 3, seconds, fraction)


def offset_s(answer: bytes, asked: bytes, sent_s: float, received_s: float) -> float:
    """Return the server's clock minus the local clock, in seconds.

    Args:
        answer: the packet received at `received_s`.
        asked: the request sent at `sent_s`.

    Raises:
        BadReading: the packet is not a response to the request, or the server's clock is not synchronized.
    """
    if len(answer) < _ANSWER.size:
        raise BadReading(f"a response must have at least {_ANSWER.size} bytes, got {len(answer)}")
    first, stratum, _, _, *words = _ANSWER.unpack_from(answer)
    if first & 7 != _SERVER or answer[24:32] != asked[40:48]:
        raise BadReading("the packet is not a response to this request")
    if not 1 <= stratum <= 15 or first >> 6 == 3:
        raise BadReading("the server's clock is not synchronized")
    arrived, left = _seconds(words[7], words[8], sent_s), _seconds(words[9], words[10], sent_s)
    return ((arrived - sent_s) + (left - received_s)) / 2


def _stamp(now_s: float) -> tuple[int, int]:
    seconds = int(now_s)
    return (seconds + _TO_1900_S) & 0xFFFFFFFF, int((now_s - seconds) * 2**32) & 0xFFFFFFFF


def _seconds(seconds: int, fraction: int, near_s: float) -> float:
    """Convert a timestamp to seconds since 1970, in the NTP era (136 years) nearest to `near_s`."""
    found = seconds - _TO_1900_S + fraction / 2**32
    return found + round((near_s - found) / 2**32) * 2**32
