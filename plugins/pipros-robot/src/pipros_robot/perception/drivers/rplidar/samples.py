"""Decode the samples that an RPLIDAR sends while it scans. This module performs no I/O.

Source: SLAMTEC, "RPLIDAR Interface Protocol and Application Notes". All numbers are little endian.

A decoder yields segments. A segment is a pair: whether its first point begins a new turn, and the points.
Angles are in degrees from 0 to 360, clockwise. Distances are in mm, and 0 if nothing was measured. Qualities
have 6 bits. In a capsule of N points, angles are computed as integers in units of 1/(64 N) degrees, so that
every turn has exactly one beginning.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import reduce
from operator import xor
from typing import Any, Final, NamedTuple, Protocol


class Point(NamedTuple):
    """One sample. The module's docstring describes the units."""

    angle: float
    distance_mm: float
    quality: int


Segment = tuple[bool, list[Point]]

VALID_QUALITY: Final = 47
"""The quality of valid points in formats without qualities."""
FASTEST_HZ: Final = 50
"""Upper bound on the rate of rotation.

If two capsules imply a higher rate, the capsules between them were lost.
"""
_TURN: Final = 360 * 64


class Decoder(Protocol):
    """Decodes one format into segments. Invalid bytes are skipped."""

    def feed(self, data: bytes) -> Iterator[Segment]:
        """Yield the segments that `data` completes."""
        ...


class StandardNodes:
    """Decodes standard scans, which have five bytes per point."""

    _NODE: Final = struct.Struct("<BBBH")

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> Iterator[Segment]:
        """Yield the segments that `data` completes."""
        data = self._rest + data
        at, is_start = 0, False
        points: list[Point] = []
        unpack, end = self._NODE.unpack_from, len(data) - self._NODE.size
        while at <= end:
            flags, low, high, quarters = unpack(data, at)
            if not (flags ^ flags >> 1) & 1 or not low & 1:
                at += 1  # no sample begins here
                continue
            if flags & 1:
                yield is_start, points
                is_start, points = True, []
            points.append(Point((high << 7 | low >> 1) / 64, quarters / 4, flags >> 2))
            at += self._NODE.size
        self._rest = data[at:]
        yield is_start, points


@dataclass(frozen=True, slots=True)
class CapsuleFormat:
    """A format that sends points in packets called capsules.

    Attributes:
        length: size of a capsule in bytes.
        count: number of points in a capsule.
        start_at: offset of the 16-bit word with the angle of the first point. The encoded points (cabins)
            follow this word.
        points: function that returns the points of a capsule. Its arguments are the cabins of the capsule,
            the cabins of the next capsule, and a function that maps the index of a point to its angle.
    """

    length: int
    count: int
    start_at: int
    points: Callable[[bytes, bytes, Callable[[int], float]], list[Point]]


class Capsules:
    """Decodes capsules.

    A capsule ends at the start angle of the next capsule, and is decoded when the next capsule arrives.
    """

    def __init__(self, form: CapsuleFormat, sample_us: float) -> None:
        self._form = form
        self._largest = FASTEST_HZ * form.count * sample_us * 1e-6 * _TURN
        self._buffer = b""
        self._previous: tuple[int, bytes] | None = None
        self._end = 0
        """The end angle of the last decoded capsule, where the next one starts unless capsules were lost."""

    def feed(self, data: bytes) -> Iterator[Segment]:
        """Yield the segments that `data` completes."""
        buffer, at, length = self._buffer + data, 0, self._form.length
        while len(buffer) - at >= length:
            first, second = buffer[at], buffer[at + 1]
            if first >> 4 == 0xA and second >> 4 == 0x5:
                capsule = buffer[at : at + length]
                if reduce(xor, capsule[2:]) == (first & 15 | (second & 15) << 4):
                    at += length
                    yield from self._decoded(capsule)
                    continue
                self._previous = None
            at += 1
        self._buffer = buffer[at:]

    def _decoded(self, capsule: bytes) -> Iterator[Segment]:
        form, (word,) = self._form, struct.unpack_from("<H", capsule, self._form.start_at)
        following = (word & 0x7FFF) % _TURN, capsule[form.start_at + 2 :]
        previous, self._previous = self._previous, following
        if previous is None or word & 0x8000:  # the device has restarted its scan
            return
        start, turned = previous[0], (following[0] - previous[0]) % _TURN
        if turned > self._largest:
            return
        first, whole = start * form.count, _TURN * form.count
        points = form.points(
            previous[1], following[1], lambda index: (first + index * turned) % whole / (64 * form.count)
        )
        # The turn begins at the first point after the step across 360 degrees. If that step was in lost
        # capsules, it begins at the first point.
        begins = -((first - whole) // turned) - 1 if turned else form.count
        if start < self._end and begins >= form.count:
            begins = 0
        self._end = following[0]
        yield False, points[:begins]
        if begins < form.count:
            yield True, points[begins:]


def _point(angle: float, distance_mm: float) -> Point:
    return Point(angle % 360, distance_mm, VALID_QUALITY if distance_mm else 0)


def _express(cabins: bytes, _: bytes, angle: Callable[[int], float]) -> list[Point]:
    """Decode pairs of distances, each with an offset from the regular angle in units of 1/8 degree."""
    points = []
    for index, (one, two, low) in enumerate(struct.iter_unpack("<HHB", cabins)):
        points.append(_point(angle(2 * index) - ((one & 3) << 4 | low & 15) / 8, one >> 2))
        points.append(_point(angle(2 * index + 1) - ((two & 3) << 4 | low >> 4) / 8, two >> 2))
    return points


def _dense(cabins: bytes, _: bytes, angle: Callable[[int], float]) -> list[Point]:
    """Decode distances in mm."""
    return [_point(angle(index), each) for index, (each,) in enumerate(struct.iter_unpack("<H", cabins))]


_SCALES: Final = ((3328, 16384, 4), (1792, 4096, 3), (1280, 2048, 2), (512, 512, 1), (0, 0, 0))
"""Ranges of 12-bit values: the first value, its distance in mm, and the exponent of the step (2**n mm)."""
_UNUSED: Final = (-512, 511)


def _scaled(value: int) -> tuple[int, int]:
    """Return the distance for a 12-bit value, and the shift to apply to differences from this distance."""
    begin, base_mm, shift = next(each for each in _SCALES if value >= each[0])
    return base_mm + ((value - begin) << shift), shift


def _ultra(cabins: bytes, following: bytes, angle: Callable[[int], float]) -> list[Point]:
    """Decode triples: a 12-bit distance and two signed 10-bit differences.

    The first difference is relative to this distance or, if this distance is 0, to the next triple's
    distance. The second difference is always relative to the distance of the next triple.
    """
    words = [word for (word,) in struct.iter_unpack("<I", cabins)]
    words.append(struct.unpack_from("<I", following)[0])
    majors = [_scaled(word & 0xFFF) for word in words]
    points = []
    for index, (word, own, other) in enumerate(zip(words, majors, majors[1:], strict=False)):
        points.append(_corrected(angle(3 * index), own[0]))
        for at, (base_mm, shift) in ((1, own if own[0] or not other[0] else other), (2, other)):
            raw = word >> (2 + 10 * at) & 0x3FF
            difference = raw - 1024 if raw & 0x200 else raw
            distance_mm = 0 if difference in _UNUSED else (difference << shift) + base_mm
            points.append(_corrected(angle(3 * index + at), max(distance_mm, 0)))
    return points


def _corrected(angle: float, distance_mm: int) -> Point:
    """Return a point whose angle is corrected for the distance between the laser and the receiver."""
    if distance_mm < 50:
        return _point(angle - 7.5, distance_mm)
    k = 98361 // (4 * distance_mm)
    offset = int(math.radians(8) * 65536) - (k << 6) - k**3 // 98304
    return _point(angle - math.degrees(offset / 65536), distance_mm)


_STEPS: Final = ((0x3FF, 2, 0), (0x7FF, 3, 2046), (0xFFF, 4, 8187), (0x1FFF, 5, 24567))
"""Indexed by a value's scale: the distance mask, and the step and the smallest distance in mm."""


def _ultra_dense(cabins: bytes, _: bytes, angle: Callable[[int], float]) -> list[Point]:
    """Decode pairs of 20-bit values: 2 bits of scale, 10 to 13 bits of distance, and the quality."""
    points: list[Point] = []
    before_mm = 0.0
    for one, two, high in struct.iter_unpack("<HHB", cabins):
        for value in (one | (high & 15) << 16, two | (high >> 4) << 16):
            mask, step, base_mm = _STEPS[value & 3]
            distance_mm: float = (value >> 2 & mask) * step + base_mm
            bits = mask.bit_length()
            quality = value >> 2 + bits << bits - 10
            if value & 3 == 0 and abs(distance_mm - before_mm) <= 2:
                distance_mm = (distance_mm + before_mm) / 2
            points.append(Point(angle(len(points)), distance_mm, quality >> 2))
            before_mm = distance_mm
    return points


FORMS: Final = {
    0x82: CapsuleFormat(84, 32, 2, _express),
    0x84: CapsuleFormat(132, 96, 2, _ultra),
    0x85: CapsuleFormat(84, 40, 2, _dense),
    0x86: CapsuleFormat(170, 64, 8, _ultra_dense),
}
"""The capsule formats by response type."""


def decoder_of(answer: int, sample_us: float) -> Any:
    """Return a decoder for a response type, or None if the type is unknown."""
    if answer == 0x81:
        return StandardNodes()
    return Capsules(FORMS[answer], sample_us) if answer in FORMS else None
