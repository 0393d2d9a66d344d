"""The requests and answers of SNTP (RFC 4330), which measure the offset of a clock. Bytes in, values out."""

from __future__ import annotations

import struct

from pipros.libraries.diagnostics.machine import BadReading

PORT = 123

_TO_1900_S = 2_208_988_800
_ANSWER = struct.Struct(">BBbb11I")
_SERVER = 4


def question(now_s: float) -> bytes:
    """The request, sent at `now_s`, the time since 1970."""
    seconds, fraction = _stamp(now_s)
    return struct.pack(">B39xII", 4 << 3 | 3, seconds, fraction)


def offset_s(answer: bytes, asked: bytes, sent_s: float, received_s: float) -> float:
    """How far the server's clock is ahead of this one, in seconds.

    Args:
        answer: the packet that came, at `received_s`.
        asked: the packet that was sent, at `sent_s`.

    Raises:
        BadReading: it is not an answer to that request, or the server does not know the time.
    """
    if len(answer) < _ANSWER.size:
        raise BadReading(f"an answer must have {_ANSWER.size} bytes, got {len(answer)}")
    first, stratum, _, _, *words = _ANSWER.unpack_from(answer)
    if first & 7 != _SERVER or answer[24:32] != asked[40:48]:
        raise BadReading("the answer is not one to this question")
    if not 1 <= stratum <= 15 or first >> 6 == 3:
        raise BadReading("the server does not know the time itself")
    arrived, left = _seconds(words[7], words[8], sent_s), _seconds(words[9], words[10], sent_s)
    return ((arrived - sent_s) + (left - received_s)) / 2


def _stamp(now_s: float) -> tuple[int, int]:
    seconds = int(now_s)
    return (seconds + _TO_1900_S) & 0xFFFFFFFF, int((now_s - seconds) * 2**32) & 0xFFFFFFFF


def _seconds(seconds: int, fraction: int, near_s: float) -> float:
    """A stamp as the time since 1970, in the era that is nearest to `near_s`: they begin every 136 years."""
    found = seconds - _TO_1900_S + fraction / 2**32
    return found + round((near_s - found) / 2**32) * 2**32
