"""Decode SCIP 2 replies. This module performs no I/O.

Source: Hokuyo, "Communication Protocol Specification for SCIP 2.0 Standard". A reply consists of the echoed
command, a status, lines of data, and an empty line. The status and the data lines have checksums.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce
from typing import Final, NamedTuple

MAX_REPLY_BYTES: Final = 1 << 18
"""Maximum size of a reply. A scan of 1,440 steps with three echoes and intensities has 26 kB."""
CLOCK_MS: Final = 1 << 24
"""The device's clock wraps to 0 after this many milliseconds."""
_FURTHER: Final = ord("&")


class InvalidReply(ValueError):
    """The data is not a SCIP 2 reply, or a checksum is wrong."""


class ScipReply(NamedTuple):
    """A reply without its checksums. `received_ns` is the arrival time of its first bytes."""

    echo: str
    status: str
    lines: list[bytes]
    received_ns: int


class Replies:
    """Splits a stream into replies."""

    def __init__(self) -> None:
        self._buffer, self._began_ns = b"", 0
        self.errors = 0
        """The number of invalid replies."""

    def feed(self, data: bytes, now_ns: int) -> Iterator[ScipReply]:
        """Yield the replies that `data` completes, and count invalid replies."""
        if not self._buffer:
            self._began_ns = now_ns
        *blocks, self._buffer = (self._buffer + data).split(b"\n\n")
        for block in blocks:
            try:
                yield _reply(block.lstrip(b"\n"), self._began_ns)
            except InvalidReply:
                self.errors += 1
            self._began_ns = now_ns
        if len(self._buffer) > MAX_REPLY_BYTES:
            self._buffer = b""
            self.errors += 1


def _reply(block: bytes, received_ns: int) -> ScipReply:
    echo, *lines = block.split(b"\n")
    if not lines:
        raise InvalidReply("a reply must have a status")
    status = lines[0] if len(lines[0]) < 3 else checked(lines[0])  # no checksum in replies to SCIP2.0
    if echo[:2] in (b"VV", b"PP", b"II"):  # KEY:value;checksum, where the checksum excludes the semicolon
        data = [checked(line[:-2] + line[-1:]) for line in lines[1:]]
    else:
        data = [checked(line) for line in lines[1:]]
    return ScipReply(echo.decode("ascii", "replace"), status.decode("ascii", "replace"), data, received_ns)


def checked(line: bytes) -> bytes:
    """Return a line without its checksum.

    Raises:
        InvalidReply: the checksum is wrong.
    """
    if not line or (sum(line[:-1]) & 0x3F) + 0x30 != line[-1]:
        raise InvalidReply(f"line {line!r} has a wrong checksum")
    return line[:-1]


def texts(lines: list[bytes]) -> dict[str, str]:
    """Return the values of lines such as `MODL:UST-10LX`."""
    pairs = (line.decode("ascii", "replace").partition(":") for line in lines)
    return {key: value for key, _, value in pairs}


def numbers(data: bytes) -> list[int]:
    """Decode 18-bit values: three characters of 6 bits each. An incomplete value at the end is dropped."""
    return [
        (high << 12) + (middle << 6) + low - 0x30 * 0x1041
        for high, middle, low in zip(data[0::3], data[1::3], data[2::3], strict=False)
    ]


def clock_ms(text: bytes) -> int:
    """Decode the device's time: four characters of 6 bits each."""
    return reduce(lambda value, char: value << 6 | (char - 0x30) & 0x3F, text[:4], 0)


def scan_of(data: bytes, *, has_intensities: bool) -> tuple[list[int], list[int]]:
    """Return the distance at each step in mm (0 for no echo), and the intensities, if included."""
    values = numbers(data)
    return (values[0::2], values[1::2]) if has_intensities else (values, [])


def echoes_of(data: bytes, *, has_intensities: bool) -> list[list[tuple[int, int]]]:
    """Return the echoes at each step: distances in mm and intensities (0 if not included).

    In the data, `&` precedes each echo of a step except the first.
    """
    steps: list[list[tuple[int, int]]] = []
    size, at = 6 if has_intensities else 3, 0
    while at < len(data):
        is_further = data[at] == _FURTHER
        at += is_further
        values = numbers(data[at : at + size])
        at += size
        if not is_further:
            steps.append([])
        if values and values[0] > 0 and steps:
            steps[-1].append((values[0], values[-1] if has_intensities else 0))
    return steps
