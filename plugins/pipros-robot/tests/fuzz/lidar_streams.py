"""Any bytes of a lidar become points and scans of bounded size, or are skipped.

The first byte of an input selects the format, the second how the rest is cut into pieces.

python -m tests.fuzz.lidar_streams --seconds 60
"""

import sys
from collections.abc import Iterator

from pipros_libraries.nodes.retrying import DeviceError
from pipros_robot.perception.drivers.rplidar.lidar import Lidar
from pipros_robot.perception.drivers.rplidar.samples import decoder_of
from pipros_robot.perception.drivers.rplidar.turns import MAX_POINTS, TurnCollector, sweep_of
from pipros_robot.perception.drivers.streams import Stream
from pipros_robot.perception.drivers.urg.scip import (
    MAX_REPLY_BYTES,
    Replies,
    clock_ms,
    echoes_of,
    scan_of,
    texts,
)
from pipros_robot.perception.drivers.urg.sensor import UrgSensor
from tests.fuzz import mutation

FORMATS = (0x81, 0x82, 0x84, 0x85, 0x86)
WORDS = [
    *(
        b"\xa5\x5a\x14\0\0\0\x04", b"\xa5\x5a\x03\0\0\0\x06", b"\xa5\x5a\xff\xff\xff\x3f\x20", b"\xa5",
        b"\x5a",
    ),
    *(
        b"\xa0\x50",
        b"\xaf\x5f",
        b"\x01\x80",
        b"\xff\x7f",
        bytes(80),
        b"\x3e\x01\0\0\0",
        b"\x3d\xff\xff\xff\xff",
    ),
    *(b"\n\n", b"\n", b"QT\n00P\n\n", b"99b\n", b"00P\n", b"&", b"ARES:1440;4\n", b"AMIN:-1;", b"PP\n00P\n"),
]  # fmt: skip


class WithoutPause(Lidar):
    """A lidar whose scan need not be stopped first."""

    def stop(self) -> None:
        self._received = b""


class FixedStream(Stream):
    """A connection over which pieces arrive, and that ends after them."""

    def __init__(self, pieces: Iterator[bytes]) -> None:
        self._pieces = pieces
        self.is_over = False

    def read(self) -> bytes:
        piece = next(self._pieces, None)
        self.is_over = piece is None
        return piece or b""

    def write(self, data: bytes) -> None:
        assert len(data) < 64


def pieces(data: bytes, size: int) -> Iterator[bytes]:
    for at in range(0, len(data), size):
        yield data[at : at + size]


def read_points(answer: int, data: bytes, size: int) -> None:
    decoder, turns = decoder_of(answer, 125.0), TurnCollector()
    for piece in pieces(data, size):
        for segment in decoder.feed(piece):
            if turn := turns.add(segment):
                assert all(0 <= point.angle < 512 and point.distance_mm >= 0 for point in turn)
                for cells in (None, 3.2):
                    sweep = sweep_of(turn, cells, is_inverted=cells is None)
                    assert len(sweep.ranges) == len(sweep.intensities) <= MAX_POINTS


def read_scans(data: bytes, size: int) -> None:
    replies = Replies()
    for number, piece in enumerate(pieces(data, size)):
        for reply in replies.feed(piece, number):
            texts(reply.lines)
            for has_intensities in (False, True):
                joined = b"".join(reply.lines[1:])
                distances, _ = scan_of(joined, has_intensities=has_intensities)
                echoes = echoes_of(joined, has_intensities=has_intensities)
                assert len(echoes) <= len(joined)
                assert len(distances) <= len(joined) <= MAX_REPLY_BYTES + size
            if reply.lines:
                assert 0 <= clock_ms(reply.lines[0]) < 1 << 24


def target(data: bytes) -> None:
    if len(data) < 2:
        return
    kind, size, rest = data[0] % 8, data[1] + 1, data[2:]
    if kind < len(FORMATS):
        read_points(FORMATS[kind], rest, size)
    elif kind == 5:
        read_scans(rest, size)
    else:
        stream = FixedStream(pieces(rest, size))
        try:
            if kind == 6:
                lidar = WithoutPause(stream, "x", lambda: stream.is_over)
                lidar.health()
                lidar.modes()
            else:
                UrgSensor(stream, "x", lambda: stream.is_over, lambda: 0)
        except DeviceError:
            pass


if __name__ == "__main__":
    sys.exit(mutation.main(target, "lidar_streams", WORDS))
