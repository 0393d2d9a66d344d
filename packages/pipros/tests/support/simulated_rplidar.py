"""An RPLIDAR on a pseudo-terminal, and the bytes of its samples. Shares no code with the driver."""

import contextlib
import os
import select
import struct
import threading
import time
import tty
from collections.abc import Callable, Sequence
from pathlib import Path

Scene = Callable[[float], float]
"""The distance in mm at an angle in degrees, clockwise; 0 for none."""

MODES = {0: ("Standard", 0x81), 1: ("Express", 0x82), 2: ("Boost", 0x84), 3: ("DenseBoost", 0x85)}
MODES[4] = ("UltraDense", 0x86)
POINTS = {0x82: 32, 0x84: 96, 0x85: 40, 0x86: 64}
PACE_S = 0.01
MOST_PENDING = 1 << 20
"""Bytes that wait for a reader that is slow, as on a busy machine."""


def xor_of(data: bytes) -> int:
    result = 0
    for byte in data:
        result ^= byte
    return result


def node(angle: float, distance_mm: float, is_start: bool, quality: int = 15) -> bytes:
    """Return a sample of a standard scan."""
    word = round(angle * 64) << 1 | 1
    return bytes([quality << 2 | (1 if is_start else 2)]) + struct.pack("<HH", word, round(distance_mm * 4))


def capsule(body: bytes) -> bytes:
    """Return a capsule: the marks with the checksum of the body, and the body."""
    check = xor_of(body)
    return bytes([0xA0 | check & 15, 0x50 | check >> 4]) + body


def start_word(angle: float, *, is_new: bool = False) -> bytes:
    return struct.pack("<H", round(angle * 64) | (0x8000 if is_new else 0))


def express(angle: float, points: Sequence[tuple[int, int]], *, is_new: bool = False) -> bytes:
    """Return a capsule of 32 points: distances in mm, and differences of the angle in 1/8 degrees."""
    cabins = b""
    for (one, first), (two, second) in zip(points[::2], points[1::2], strict=True):
        low = first & 15 | (second & 15) << 4
        cabins += struct.pack("<HHB", one << 2 | first >> 4, two << 2 | second >> 4, low)
    return capsule(start_word(angle, is_new=is_new) + cabins)


def dense(angle: float, distances_mm: Sequence[int], *, is_new: bool = False) -> bytes:
    """Return a capsule of 40 points."""
    return capsule(start_word(angle, is_new=is_new) + struct.pack("<40H", *distances_mm))


def ultra(angle: float, words: Sequence[tuple[int, int, int]], *, is_new: bool = False) -> bytes:
    """Return a capsule of 96 points: a 12-bit value and two differences for each three."""
    packed = [major | (one & 0x3FF) << 12 | (two & 0x3FF) << 22 for major, one, two in words]
    return capsule(start_word(angle, is_new=is_new) + struct.pack("<32I", *packed))


def ultra_dense(angle: float, values: Sequence[int], *, is_new: bool = False) -> bytes:
    """Return a capsule of 64 values with 20 bits."""
    cabins = b"".join(
        struct.pack("<HHB", one & 0xFFFF, two & 0xFFFF, one >> 16 | two >> 16 << 4)
        for one, two in zip(values[::2], values[1::2], strict=True)
    )
    return capsule(struct.pack("<IH", 0, 0) + start_word(angle, is_new=is_new) + cabins)


def ultra_dense_value(distance_mm: int, quality: int) -> int:
    """Return the value of a distance, with the finest scale that reaches so far."""
    for scale, (begin, step, bits) in enumerate(((0, 2, 10), (2046, 3, 11), (8187, 4, 12), (24567, 5, 13))):
        steps = (distance_mm - begin) // step
        if steps < 1 << bits:
            return scale | steps << 2 | quality >> (bits - 10) << (2 + bits)
    raise ValueError(f"{distance_mm} mm is too far")


def major(distance_mm: int) -> int:
    """Return the 12-bit value of a distance."""
    for begin, base_mm, shift in ((3328, 16384, 4), (1792, 4096, 3), (1280, 2048, 2), (512, 512, 1)):
        if distance_mm >= base_mm:
            return begin + (distance_mm - base_mm >> shift)
    return distance_mm


class SimulatedRplidar:
    """A device that is plugged in and unplugged, at the path of a link.

    Attributes:
        path: the link to the pseudo-terminal.
        requests: the commands that were received, with their payloads.
        is_silent, garbage, health: faults: it answers nothing; it sends these bytes instead of samples; the
            status and code that it reports.
        scan_hz, samples: the frequency of turns, and the points of each.
    """

    def __init__(
        self,
        path: Path,
        scene: Scene,
        *,
        model: int = 0x18,
        firmware: tuple[int, int] = (1, 29),
        typical: int = 0,
        samples: int = 360,
        scan_hz: float = 10.0,
        has_board: bool = False,
    ) -> None:
        self.path, self.scene = path, scene
        self.model, self.firmware, self.typical, self.has_board = model, firmware, typical, has_board
        self.samples, self.scan_hz = samples, scan_hz
        self.requests: list[tuple[int, bytes]] = []
        self.is_silent, self.garbage, self.health = False, b"", (0, 0)
        self._answer, self._pending = 0, b""
        self._sent = 0.0
        self._fds: tuple[int, int] | None = None
        self._thread: threading.Thread | None = None
        self._is_out = threading.Event()
        self.plug_in()

    def plug_in(self) -> None:
        """Make the port, with a device that has just been powered."""
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        self._fds, self._answer, self._pending = (master, slave), 0, b""
        self._is_out.clear()
        self.path.symlink_to(os.ttyname(slave))
        self._thread = threading.Thread(target=self._run, args=(master,), daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Remove the port."""
        if self._fds is None or self._thread is None:
            return
        self._is_out.set()
        self._thread.join()
        self.path.unlink()
        for descriptor in self._fds:
            os.close(descriptor)
        self._fds = None

    @property
    def is_scanning(self) -> bool:
        """Whether it sends samples."""
        return self._answer != 0

    def commands(self) -> list[int]:
        """Return the commands that were received."""
        return [command for command, _ in self.requests]

    def _run(self, master: int) -> None:
        buffer = b""
        while not self._is_out.is_set():
            if select.select([master], [], [], PACE_S)[0]:
                buffer = self._handled(master, buffer + os.read(master, 4096))
            if self._answer and not self.is_silent:
                self._send(master, self.garbage or self._due())

    def _handled(self, master: int, buffer: bytes) -> bytes:
        """Handle the requests in `buffer`, and return its rest."""
        while (at := buffer.find(b"\xa5")) >= 0 and len(buffer) >= at + 2:
            buffer = buffer[at:]
            command, payload, size = buffer[1], b"", 2
            if command >= 0x80:
                if len(buffer) < 3 or len(buffer) < 4 + buffer[2]:
                    break
                size, payload = 4 + buffer[2], buffer[3 : 3 + buffer[2]]
                assert xor_of(buffer[:size]) == 0, f"wrong checksum of a request: {buffer[:size]!r}"
            self.requests.append((command, payload))
            buffer = buffer[size:]
            if not self.is_silent:
                self._answer_to(master, command, payload)
        return buffer

    def _answer_to(self, master: int, command: int, payload: bytes) -> None:
        def answer(kind: int, data: bytes, mode: int = 0) -> None:
            self._send(master, b"\xa5\x5a" + struct.pack("<IB", len(data) | mode << 30, kind) + data)

        minor, major_version = self.firmware[1], self.firmware[0]
        if command in (0x25, 0x40):
            self._answer, self._pending = 0, b""
        elif command == 0x50:
            answer(0x04, bytes([self.model, minor, major_version, 7]) + bytes(range(16)))
        elif command == 0x52:
            answer(0x06, struct.pack("<BH", *self.health))
        elif command == 0x59:
            answer(0x15, struct.pack("<HH", 500, 250))
        elif command == 0xFF:
            answer(0xFF, struct.pack("<I", self.has_board))
        elif command == 0x84:
            answer(0x20, payload[:4] + self._config(struct.unpack("<I", payload[:4])[0], payload[4:]))
        elif command in (0x20, 0x82):
            kind = MODES[payload[0] or 1][1] if command == 0x82 else 0x81
            sizes = {0x81: 5, 0x82: 84, 0x84: 132, 0x85: 84, 0x86: 170}
            self._send(master, b"\xa5\x5a" + struct.pack("<IB", sizes[kind] | 1 << 30, kind))
            self._answer, self._sent = kind, time.monotonic()
            self._index = 0

    def _config(self, item: int, of: bytes) -> bytes:
        number = struct.unpack("<H", of)[0] if of else 0
        sample_us = 1e6 / (self.samples * self.scan_hz)
        values = {0x70: struct.pack("<H", len(MODES)), 0x7C: struct.pack("<H", self.typical)}
        values[0x71], values[0x74] = struct.pack("<I", round(sample_us * 256)), struct.pack("<I", 12 * 256)
        values[0x75], values[0x7F] = bytes([MODES[number][1]]), MODES[number][0].encode() + b"\0"
        values[0x01] = struct.pack("<HH", 600, 700)
        return values[item]

    def _due(self) -> bytes:
        """Return the samples since the last call."""
        count = POINTS.get(self._answer, 1)
        period_s = count / (self.samples * self.scan_hz)
        frames = b""
        while self._sent + period_s < time.monotonic():
            self._sent += period_s
            frames += self._frame(count)
            self._index += count
        return frames

    def _frame(self, count: int) -> bytes:
        step = 360 / self.samples
        angles = [(self._index + k) * step % 360 for k in range(count)]
        distances = [round(self.scene(angle)) for angle in angles]
        is_new = self._index == 0
        if self._answer == 0x81:
            return node(angles[0], distances[0], angles[0] < step - 1e-9)
        if self._answer == 0x82:
            return express(angles[0], [(each, 0) for each in distances], is_new=is_new)
        if self._answer == 0x84:
            near = [major(each) for each in distances[::3]]
            words = [(each, at % 40 - 20 if each else -512, at % 15) for at, each in enumerate(near)]
            return ultra(angles[0], words, is_new=is_new)
        if self._answer == 0x85:
            return dense(angles[0], distances, is_new=is_new)
        values = [ultra_dense_value(each, 100) if each else 0 for each in distances]
        return ultra_dense(angles[0], values, is_new=is_new)

    def _send(self, master: int, data: bytes) -> None:
        """Send what the port takes now, and the rest later, unless it is too much."""
        self._pending = (self._pending + data)[:MOST_PENDING]
        with contextlib.suppress(BlockingIOError):
            self._pending = self._pending[os.write(master, self._pending) :]
