"""Control an RPLIDAR over a stream: read device information and scan modes, run the motor, and start scans.

Source: SLAMTEC, "RPLIDAR Interface Protocol and Application Notes".
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from enum import IntEnum
from functools import reduce
from operator import xor
from typing import Any, Final, NamedTuple

from pipros_libraries.nodes.retrying import DeviceError
from pipros_robot.perception.drivers.rplidar.samples import Decoder, decoder_of
from pipros_robot.perception.drivers.streams import Stream

ANSWER_S: Final = 1.0
STOP_S: Final = 0.1
"""How long a device may continue to send after it has been stopped."""
RESET_S: Final = 15.0
MAX_ANSWER_BYTES: Final = 256
_MARK: Final = b"\xa5\x5a"


class LidarCommand(IntEnum):
    """Request codes. Requests with codes >= 0x80 have a payload."""

    STOP = 0x25
    RESET = 0x40
    SCAN = 0x20
    GET_INFO = 0x50
    GET_HEALTH = 0x52
    GET_SAMPLE_RATE = 0x59
    EXPRESS_SCAN = 0x82
    GET_CONFIG = 0x84
    MOTOR_SPEED = 0xA8
    MOTOR_POWER = 0xF0
    GET_BOARD_FLAGS = 0xFF


_ANSWERS: Final = {
    LidarCommand.GET_INFO: 0x04,
    LidarCommand.GET_HEALTH: 0x06,
    LidarCommand.GET_SAMPLE_RATE: 0x15,
    LidarCommand.GET_CONFIG: 0x20,
    LidarCommand.GET_BOARD_FLAGS: 0xFF,
}


class ConfigurationItem(IntEnum):
    """Configuration items that `GET_CONFIG` can read."""

    DESIRED_SPEED = 0x01
    MODE_COUNT = 0x70
    SAMPLE_US = 0x71
    MAX_DISTANCE = 0x74
    ANSWER = 0x75
    TYPICAL_MODE = 0x7C
    MODE_NAME = 0x7F


def request(command: LidarCommand, payload: bytes = b"") -> bytes:
    """Encode a request."""
    data = bytes([0xA5, command])
    if command >= 0x80:
        data += bytes([len(payload)]) + payload
        data += bytes([reduce(xor, data)])
    return data


class DeviceInfo(NamedTuple):
    """Information about a device. The upper four bits of `model`, a byte, are the series."""

    model: int
    firmware: tuple[int, int]
    hardware: int
    serial: str


class Mode(NamedTuple):
    """A scan mode. `answer` is the response type that identifies its sample format."""

    number: int
    name: str
    sample_us: float
    max_distance_m: float
    answer: int


class Lidar:
    """An RPLIDAR on a newly opened stream. Not thread-safe."""

    def __init__(self, stream: Stream, name: str, is_ending: Callable[[], bool]) -> None:
        """Stop a running scan, and request the device information.

        Args:
            name: name of the device for error messages.
            is_ending: function that returns True when the node is shutting down. Waits for responses
                then end with DeviceError.

        Raises:
            DeviceError: the device does not respond like an RPLIDAR. All methods can raise it.
        """
        self._stream, self.name, self._is_ending = stream, name, is_ending
        self._received = b""
        self.stop()
        model, minor, major, hardware, serial = struct.unpack(
            "<BBBB16s", self._ask(LidarCommand.GET_INFO, 20)
        )
        self.info = DeviceInfo(model, (major, minor), hardware, serial.hex().upper())
        self._series = model >> 4
        self._has_config = self._series >= 4 or self.info.firmware >= (1, 24)
        self._has_power = 2 <= self._series < 6 and self._has_board()

    def reset(self) -> None:
        """Restart the device, and wait up to `RESET_S` until it responds."""
        self._stream.write(request(LidarCommand.RESET))
        end_s = time.monotonic() + RESET_S
        while True:
            try:
                self.stop()
                self._ask(LidarCommand.GET_INFO, 20)
                return
            except DeviceError:
                if self._is_ending() or time.monotonic() > end_s:
                    raise

    def health(self) -> tuple[int, int]:
        """Return the status (0 good, 1 warning, 2 error) and the error code."""
        status, code = struct.unpack("<BH", self._ask(LidarCommand.GET_HEALTH, 3))
        return status, code

    def modes(self) -> tuple[list[Mode], int]:
        """Return the scan modes, and the number of the default mode."""
        if not self._has_config:
            standard_us, express_us = struct.unpack("<HH", self._ask(LidarCommand.GET_SAMPLE_RATE, 4))
            modes = [Mode(0, "Standard", standard_us, 16.0, 0x81), Mode(1, "Express", express_us, 16.0, 0x82)]
            return (modes, 1) if self.info.firmware >= (1, 17) else (modes[:1], 0)
        (count,) = self._config(ConfigurationItem.MODE_COUNT, "<H")
        modes = []
        for number in range(min(count, 64)):
            of = struct.pack("<H", number)
            (sample_us,), (distance,) = (
                self._config(item, "<I", of)
                for item in (ConfigurationItem.SAMPLE_US, ConfigurationItem.MAX_DISTANCE)
            )
            (answer,), name = (
                self._config(ConfigurationItem.ANSWER, "<B", of),
                self._ask_config(ConfigurationItem.MODE_NAME, of),
            )
            text = name.partition(b"\0")[0].decode("ascii", "replace")
            modes.append(Mode(number, text, sample_us / 256, distance / 256, answer))
        return modes, self._config(ConfigurationItem.TYPICAL_MODE, "<H")[0]

    def start(self, mode: Mode) -> Decoder:
        """Start a scan, and return a decoder for the data that `read` returns."""
        decoder: Decoder | None = decoder_of(mode.answer, mode.sample_us)
        if decoder is None:
            raise DeviceError(f"{self.name} uses the unknown format {mode.answer:#x} in mode {mode.name}")
        if mode.answer == 0x81:
            self._send(LidarCommand.SCAN)
        else:
            legacy = not self._has_config
            self._send(LidarCommand.EXPRESS_SCAN, struct.pack("<BHH", 0 if legacy else mode.number, 0, 0))
        self._wait_for_answer(mode.answer, "the start of a scan")
        return decoder

    def read(self) -> bytes:
        """Return the received data. Wait for at most a fraction of a second; the result may be empty."""
        data, self._received = self._received, b""
        return data or self._stream.read()

    def stop(self) -> None:
        """Stop the scan, and discard data that arrives within `STOP_S`."""
        self._stream.write(request(LidarCommand.STOP))
        end_s = time.monotonic() + STOP_S
        while time.monotonic() < end_s:
            self._stream.read()
        self._received = b""

    def turn_motor(self, scan_hz: float) -> None:
        """Start the motor, or stop it if `scan_hz` is 0. Models before series 6 turn at their own rate."""
        if self._series >= 6:
            self._send(LidarCommand.MOTOR_SPEED, struct.pack("<H", min(round(60 * scan_hz), 0xFFFF)))
        elif self._has_power:
            desired = (
                self._config(ConfigurationItem.DESIRED_SPEED, "<HH")[1]
                if self._has_config and scan_hz
                else 660
            )
            self._send(LidarCommand.MOTOR_POWER, struct.pack("<H", desired if scan_hz else 0))
        else:
            self._stream.set_dtr(not scan_hz)

    def _has_board(self) -> bool:
        """Return whether an accessory board controls the motor's power."""
        (flags,) = struct.unpack("<I", self._ask(LidarCommand.GET_BOARD_FLAGS, 4, bytes(4)))
        return bool(flags & 1)

    def _config(self, item: ConfigurationItem, form: str, of: bytes = b"") -> tuple[Any, ...]:
        value = self._ask_config(item, of)
        if len(value) < struct.calcsize(form):
            raise DeviceError(
                f"{self.name} returned only {len(value)} bytes for configuration item {item:#x}"
            )
        return struct.unpack_from(form, value)

    def _ask_config(self, item: ConfigurationItem, of: bytes) -> bytes:
        echo = struct.pack("<I", item)
        answer = self._ask(LidarCommand.GET_CONFIG, None, echo + of)
        if answer[:4] != echo:
            raise DeviceError(f"{self.name} did not return the requested configuration item {item:#x}")
        return answer[4:]

    def _send(self, command: LidarCommand, payload: bytes = b"") -> None:
        self._stream.write(request(command, payload))

    def _ask(self, command: LidarCommand, length: int | None, payload: bytes = b"") -> bytes:
        self._received = b""
        self._send(command, payload)
        what = command.name
        size = self._wait_for_answer(_ANSWERS[command], what)
        if size > MAX_ANSWER_BYTES or length not in (None, size):
            raise DeviceError(
                f"{self.name}: the answer to {what} must have "
                f"{length or f'at most {MAX_ANSWER_BYTES}'} bytes, got {size}"
            )
        self._wait(lambda: len(self._received) >= size, what)
        answer, self._received = self._received[:size], self._received[size:]
        return answer

    def _wait_for_answer(self, kind: int, what: str) -> int:
        """Skip data up to the end of the next response header. Return the length of the payload."""

        def is_here() -> bool:
            while True:
                at = self._received.find(_MARK)
                self._received = self._received[at:] if at >= 0 else self._received[-1:]
                if at < 0 or len(self._received) < 7:
                    return False
                if self._received[6] == kind:
                    return True
                self._received = self._received[2:]

        self._wait(is_here, what)
        (size,) = struct.unpack_from("<I", self._received, 2)
        self._received = self._received[7:]
        return int(size & 0x3FFFFFFF)

    def _wait(self, is_here: Callable[[], bool], what: str) -> None:
        end_s = time.monotonic() + ANSWER_S
        while not is_here():
            if self._is_ending():
                raise DeviceError("the node is shutting down")
            if time.monotonic() > end_s:
                raise DeviceError(
                    f"{self.name} does not answer {what} like an RPLIDAR; the baud rate may be wrong"
                )
            self._received += self._stream.read()
