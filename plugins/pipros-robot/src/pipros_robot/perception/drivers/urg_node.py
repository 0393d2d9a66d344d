"""The program `urg_node`, which publishes the scans of Hokuyo's laser scanners."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import MissingExtra
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import InvalidParameter, private
from pipros_libraries.nodes.retrying import DeviceError, DevicePort, Driver
from pipros_libraries.reconfiguring.server import Reconfigurable, Setting, Value
from pipros_robot.perception.drivers.streams import Stream, network_port, serial_port
from pipros_robot.perception.drivers.urg.clock import DeviceClock
from pipros_robot.perception.drivers.urg.health import LidarHealth
from pipros_robot.perception.drivers.urg.scip import ScipReply, clock_ms, echoes_of, scan_of
from pipros_robot.perception.drivers.urg.sensor import ScanRequest, UrgSensor

if TYPE_CHECKING:
    from sensor_msgs.msg import LaserEcho, LaserScan, MultiEchoLaserScan

SILENCE_S: Final = 2.0
QUEUE_SIZE: Final = 20
NAN: Final = math.nan
_RESTARTS: Final = 1
"""The level of settings whose changes restart the stream."""


class UrgNode:
    """Publishes `scan`, or `echoes`, `first`, `last` and `most_intense` if `~publish_multiecho` is true."""

    def __init__(self, node: Node, log: logging.Logger) -> None:
        """Read the parameters, and advertise the topics. Blocks until the master answers.

        Raises:
            MissingExtra: the device is on a serial port, and pyserial is not installed.
        """
        self._node, self._log = node, log
        place, self._port = _port(node)
        self._driver = Driver(node, log, self._port, self._session)
        self._has_intensities = private(node, "publish_intensity", True)
        self._has_echoes = private(node, "publish_multiecho", False)
        self._measures_latency = private(node, "calibrate_time", False)
        self._clock = DeviceClock() if private(node, "synchronize_time", False) else None
        self._error_limit = private(node, "error_limit", 4)
        self._scan: type[LaserScan] = load_message_class("sensor_msgs/LaserScan")
        self._echoes: type[MultiEchoLaserScan] = load_message_class("sensor_msgs/MultiEchoLaserScan")
        self._echo: type[LaserEcho] = load_message_class("sensor_msgs/LaserEcho")
        names = ("first", "last", "most_intense") if self._has_echoes else ("scan",)
        self._outputs = {name: node.advertise(name, self._scan, queue_size=QUEUE_SIZE) for name in names}
        if self._has_echoes:
            self._outputs["echoes"] = node.advertise("echoes", self._echoes, queue_size=QUEUE_SIZE)
        self._settings: Reconfigurable | None = None
        self._is_changed = threading.Event()
        self._latency_s = 0.0
        self._sensor: UrgSensor | None = None
        self._health = LidarHealth(node, place, "Laser Echoes" if self._has_echoes else "Laser Scan")

    def run(self) -> int:
        """Publish until the node is shut down, and return the exit code."""
        threading.Thread(target=self._health.run, name="diagnostics", daemon=True).start()
        return self._driver.run()

    def _session(self, stream: Stream) -> None:
        try:
            sensor = UrgSensor(
                stream, self._port.name, lambda: self._driver.is_ending, self._node.clock.now_ns
            )
            self._configure(sensor)
            if self._measures_latency:
                self._latency_s = sensor.latency_s(self._request(sensor))
            while not self._driver.is_ending:
                self._is_changed.clear()
                request = self._started(sensor)
                self._health.connect(sensor, request)
                try:
                    self._publish_scans(sensor, request)
                finally:
                    with suppress(DeviceError):
                        sensor.stop()
        except DeviceError as error:
            self._health.disconnect(str(error))
            raise

    def _configure(self, sensor: UrgSensor) -> None:
        """Log the device's information. On the first connection, offer settings within its limits."""
        version = sensor.version
        self._driver.describe(", ".join(version.get(key, "?") for key in ("PROD", "SERI", "FIRM")))
        if self._settings is None:
            known = sensor.parameters
            low, high = known.angle(known.first), known.angle(known.last)
            settings = (
                Setting("angle_min", -math.pi, low, high, "First angle (rad)", _RESTARTS),
                Setting("angle_max", math.pi, low, high, "Last angle (rad)", _RESTARTS),
                Setting("cluster", 1, 1, 99, "Number of steps to merge into one", _RESTARTS),
                Setting("skip", 0, 0, 9, "Number of scans to omit after each scan", _RESTARTS),
                Setting("frame_id", "laser", description="Frame of the scans"),
                Setting("tf_prefix", "", description="Prefix of the frame"),
                Setting("time_offset", 0.0, -10, 10, "Seconds to add to timestamps"),
            )
            self._settings = Reconfigurable(self._node, "~", settings, self._change)

    def _change(self, _: Mapping[str, Value], level: int) -> None:
        if level & _RESTARTS:
            self._is_changed.set()

    def _setting(self, name: str) -> Any:
        return self._settings.values[name] if self._settings else None

    def _request(self, sensor: UrgSensor) -> ScanRequest:
        first, last = (sensor.parameters.step(self._setting(name)) for name in ("angle_min", "angle_max"))
        if first > last:
            self._log.error("~angle_min must be <= ~angle_max: using the device's full range")
            first, last = sensor.parameters.first, sensor.parameters.last
        how = self._setting("cluster"), self._setting("skip"), self._has_intensities, self._has_echoes
        return ScanRequest(first, last, *how)

    def _started(self, sensor: UrgSensor) -> ScanRequest:
        request = self._request(sensor)
        if sensor.start(request):
            return request
        if not self._has_intensities:
            what = "multi-echo scans" if self._has_echoes else "scans"
            raise DeviceError(f"{self._port.name} cannot send {what}")
        self._log.warning("%s does not provide intensities", self._port.name)
        self._has_intensities = False
        return self._started(sensor)

    def _publish_scans(self, sensor: UrgSensor, request: ScanRequest) -> None:
        """Publish scans until a setting that restarts the stream changes, or the node is shut down."""
        last_s, errors = time.monotonic(), sensor.errors
        while not self._driver.is_ending and not self._is_changed.is_set():
            for reply in sensor.scans(request):
                self._publish(reply, sensor, request)
                self._driver.report_data()
                self._health.window.count += 1
                last_s, errors = time.monotonic(), sensor.errors
            if sensor.errors - errors > self._error_limit:
                raise DeviceError(f"{self._port.name} sends too many invalid replies")
            if time.monotonic() - last_s > SILENCE_S:
                raise DeviceError(f"{self._port.name} sends no scans")

    def _publish(self, reply: ScipReply, sensor: UrgSensor, request: ScanRequest) -> None:
        known, cluster = sensor.parameters, request.cluster
        fields: dict[str, Any] = {
            "angle_min": known.angle(request.first),
            "angle_max": known.angle(request.last),
            "angle_increment": cluster * math.tau / known.turn,
            "time_increment": cluster * known.scan_s / known.turn,
            "scan_time": known.scan_s,
            "range_min": known.nearest_mm / 1000,
            "range_max": known.farthest_mm / 1000,
        }
        stamp_s = reply.received_ns / NS_PER_S
        if self._clock is not None:
            stamp_s = self._clock.host_s(clock_ms(reply.lines[0]), stamp_s)
        behind_s = known.scan_s * (fields["angle_min"] + math.pi) / math.tau
        stamp_ns = round((stamp_s + self._latency_s + self._setting("time_offset") + behind_s) * NS_PER_S)
        data, has = b"".join(reply.lines[1:]), request.has_intensities
        if request.has_echoes:
            self._publish_echoes(echoes_of(data, has_intensities=has), fields, stamp_ns, has)
        else:
            distances, intensities = scan_of(data, has_intensities=has)
            ranges = [each / 1000 if each else NAN for each in distances]
            values = [value if each else 0 for value, each in zip(intensities, distances, strict=False)]
            self._send("scan", stamp_ns, self._scan(**fields, ranges=ranges, intensities=values))

    def _publish_echoes(
        self, steps: Sequence[Sequence[tuple[int, int]]], fields: Mapping[str, Any], stamp_ns: int, has: bool
    ) -> None:
        """Publish all echoes of each step, and scans with one echo per step, to topics with subscribers."""
        for name, choose in _CHOICES.items():
            if self._outputs[name].connection_count and (has or name != "most_intense"):
                found = [choose(step) if step else (NAN, 0) for step in steps]
                scan = self._scan(**fields, ranges=[mm / 1000 for mm, _ in found])
                scan.intensities = [value for _, value in found] if has else []
                self._send(name, stamp_ns, scan)
        if self._outputs["echoes"].connection_count:
            message = self._echoes(**fields)
            message.ranges = [self._echo([mm / 1000 for mm, _ in step]) for step in steps]
            message.intensities = [self._echo([value for _, value in step]) for step in steps] if has else []
            self._send("echoes", stamp_ns, message)

    def _send(self, name: str, stamp_ns: int, message: Any) -> None:
        prefix, frame = self._setting("tf_prefix").strip("/"), self._setting("frame_id").lstrip("/")
        message.header.frame_id = f"{prefix}/{frame}" if prefix else frame
        message.header.stamp = Time(*divmod(max(stamp_ns, 0), NS_PER_S))
        self._outputs[name].publish(message)


_CHOICES: Final[dict[str, Callable[[Sequence[tuple[int, int]]], tuple[float, int]]]] = {
    "first": lambda step: step[0],
    "last": lambda step: step[-1],
    "most_intense": lambda step: max(step, key=lambda echo: echo[1]),
}
"""Functions that select the echo of a step, by output. The output `echoes` has all echoes."""


def _port(node: Node) -> tuple[dict[str, str], DevicePort[Stream]]:
    """Return the diagnostic values for the port specified by the parameters, and the port."""
    host, number = private(node, "ip_address", ""), private(node, "ip_port", 10940)
    if host:
        return {"IP Address": host, "IP Port": str(number)}, network_port(host, number)
    path, baud = private(node, "serial_port", "/dev/ttyACM0"), private(node, "serial_baud", 115200)
    return {"Serial Port": path, "Serial Baud": str(baud)}, serial_port(path, baud)


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `urg_node` until the node is shut down. Return the exit code."""
    with roscpp_program("urg_node", "urg_node", argv) as (node, log):
        try:
            return UrgNode(node, log).run()
        except (MissingExtra, InvalidParameter) as error:
            log.critical("%s", error)
            return 1
