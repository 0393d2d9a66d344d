"""Control a SCIP 2 laser scanner over a stream: read its parameters and state, and receive scans.

Source: Hokuyo, "Communication Protocol Specification for SCIP 2.0 Standard".
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from statistics import median
from typing import Final

from pipros_libraries.nodes.retrying import DeviceError
from pipros_robot.perception.drivers.streams import Stream
from pipros_robot.perception.drivers.urg.scip import CLOCK_MS, Replies, ScipReply, clock_ms, texts

ANSWER_S: Final = 1.0
CALIBRATION_SCANS: Final = 10


@dataclass(frozen=True, slots=True)
class DeviceParameters:
    """Parameters of a device.

    Attributes:
        turn: number of steps in a full turn.
        first, last: the range of steps that the device measures.
        front: the step at angle 0.
        nearest_mm, farthest_mm: the range of distances that the device measures.
        scan_s: duration of a full turn.
    """

    turn: int
    first: int
    last: int
    front: int
    nearest_mm: int
    farthest_mm: int
    scan_s: float

    def angle(self, step: int) -> float:
        """Return the angle of a step in radians."""
        return math.tau * (step - self.front) / self.turn

    def step(self, angle: float) -> int:
        """Return the step nearest to an angle in radians, within the measured range."""
        return min(max(math.floor(self.turn * angle / math.tau + 0.5) + self.front, self.first), self.last)


@dataclass(frozen=True, slots=True)
class ScanRequest:
    """Parameters of a scan.

    Attributes:
        first, last: the range of steps.
        cluster: number of adjacent steps to merge into one measurement.
        skip: number of scans to omit after each scan.
    """

    first: int
    last: int
    cluster: int
    skip: int
    has_intensities: bool
    has_echoes: bool

    @property
    def command(self) -> str:
        """The command that starts a stream of these scans."""
        kind = ("N" if self.has_echoes else "M") + ("E" if self.has_intensities else "D")
        return f"{kind}{self.first:04}{self.last:04}{self.cluster:02}{self.skip}00"


class UrgSensor:
    """A laser scanner on a newly opened stream. Not thread-safe.

    Attributes:
        parameters: the device's parameters.
        version, state: the device's responses to VV and II, by SCIP key.
    """

    def __init__(
        self, stream: Stream, name: str, is_ending: Callable[[], bool], now_ns: Callable[[], int]
    ) -> None:
        """Stop a running scan stream, and request the device's parameters.

        Args:
            name: name of the device for error messages.
            is_ending: function that returns True when the node is shutting down. All waits then end with
                DeviceError.
            now_ns: function that returns the current time.

        Raises:
            DeviceError: the device does not respond in SCIP 2. All methods can raise it.
        """
        self._stream, self.name, self._is_ending, self._now_ns = stream, name, is_ending, now_ns
        self._replies = Replies()
        if self.ask("QT").status != "00":
            for command in ("SCIP2.0", "TM2"):  # leave SCIP 1 or time adjustment mode
                self.ask(command)
            self._ask_well("QT")
        self.parameters = self._parameters(texts(self._ask_well("PP").lines))
        self.version = texts(self._ask_well("VV").lines)
        self.state = texts(self._ask_well("II").lines)

    @property
    def errors(self) -> int:
        """The number of invalid replies so far."""
        return self._replies.errors

    def start(self, request: ScanRequest) -> bool:
        """Switch the laser on, and start a stream. Return False if the device rejects the request."""
        if (status := self.ask("BM").status) not in ("00", "02"):
            raise DeviceError(f"{self.name} cannot switch its laser on: status {status}")
        return self.ask(request.command).status == "00"

    def stop(self) -> None:
        """Stop the stream, and switch the laser off."""
        self._ask_well("QT")

    def scans(self, request: ScanRequest) -> Iterator[ScipReply]:
        """Yield the scans received from a stream. Wait for data for at most a fraction of a second.

        The first line of each reply is the device's time, and the remaining lines are the data.
        """
        command = request.command[:-2]
        for reply in self._read():
            if reply.echo[:-2] != command or reply.status == "00":
                continue
            if reply.status != "99" or not reply.lines:
                raise DeviceError(f"{self.name} stopped its scans with status {reply.status}")
            yield reply

    def latency_s(self, request: ScanRequest) -> float:
        """Return the negated median time between the device's timestamp of a scan and the scan's arrival.

        Return 0 if the device rejects the request.
        """
        self._ask_well("TM0")
        offsets = []
        for _ in range(CALIBRATION_SCANS):
            before_ns = self._now_ns()
            device_ms = clock_ms(self._ask_well("TM1").lines[0])
            offsets.append((before_ns + self._now_ns()) / 2e6 - device_ms)
        self._ask_well("TM2")
        offset_ms = median(offsets)
        if not self.start(request):
            return 0.0
        ages: list[float] = []
        end_s = time.monotonic() + ANSWER_S + CALIBRATION_SCANS * self.parameters.scan_s * (request.skip + 1)
        while len(ages) < CALIBRATION_SCANS:
            if time.monotonic() > end_s or self._is_ending():
                raise DeviceError(f"{self.name} sends too few scans to measure the latency")
            for reply in self.scans(request):
                age_ms = reply.received_ns / 1e6 - clock_ms(reply.lines[0]) - offset_ms
                ages.append((age_ms + CLOCK_MS / 2) % CLOCK_MS - CLOCK_MS / 2)
        self.stop()
        return -median(ages) / 1000

    def ask(self, command: str) -> ScipReply:
        """Send a command, and return the reply."""
        self._stream.write(f"{command}\n".encode())
        end_s = time.monotonic() + ANSWER_S
        while not self._is_ending():
            for reply in self._read():
                if reply.echo == command:
                    return reply
            if time.monotonic() > end_s:
                raise DeviceError(f"{self.name} does not answer {command} in SCIP 2")
        raise DeviceError("the node is shutting down")

    def _ask_well(self, command: str) -> ScipReply:
        reply = self.ask(command)
        if reply.status != "00":
            raise DeviceError(f"{self.name} answered {command} with status {reply.status}")
        return reply

    def _read(self) -> Iterator[ScipReply]:
        return self._replies.feed(self._stream.read(), self._now_ns())

    def _parameters(self, values: Mapping[str, str]) -> DeviceParameters:
        try:
            turn, first, last, front, nearest, farthest, speed = (
                int(values[key]) for key in ("ARES", "AMIN", "AMAX", "AFRT", "DMIN", "DMAX", "SCAN")
            )
            if not (0 <= first <= last <= 9999 and turn > 0 and speed > 0):
                raise ValueError
        except (KeyError, ValueError):
            raise DeviceError(f"{self.name} has invalid parameters: {dict(values)}") from None
        return DeviceParameters(turn, first, last, front, nearest, farthest, 60 / speed)
