"""The program `rplidarNode` of rplidar_ros, which publishes the scans of an RPLIDAR."""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from pipros.basics.errors import MissingExtra
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class, load_service_class
from pipros.msg.time import NS_PER_S, Time
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program
from pipros_libraries.nodes.params import private
from pipros_libraries.nodes.retrying import DeviceError, DevicePort, Driver
from pipros_robot.perception.drivers.rplidar.lidar import Lidar, Mode
from pipros_robot.perception.drivers.rplidar.samples import Point
from pipros_robot.perception.drivers.rplidar.turns import TurnCollector, cells_per_degree, sweep_of
from pipros_robot.perception.drivers.streams import Stream, network_port, serial_port

if TYPE_CHECKING:
    from sensor_msgs.msg import LaserScan

SILENCE_S: Final = 5.0
"""The scan is restarted if no turn is completed for this long. A motor needs seconds to reach its speed."""
QUEUE_SIZE: Final = 1000
RANGE_MIN_M: Final = 0.15


class RplidarNode:
    """Publishes `scan`, and serves `start_motor` and `stop_motor`."""

    def __init__(self, node: Node, log: logging.Logger) -> None:
        """Read the parameters, and advertise the topic and services. Blocks until the master answers.

        Raises:
            MissingExtra: the device is on a serial port, and pyserial is not installed.
        """
        self._node, self._port = node, _port(node, log)
        self._driver = Driver(node, log, self._port, self._session)
        self._frame = private(node, "frame_id", "laser_frame")
        self._is_inverted = private(node, "inverted", False)
        self._is_regular = private(node, "angle_compensate", False)
        self._resets = private(node, "initial_reset", False)
        self._mode = private(node, "scan_mode", "")
        usual_hz = 20.0 if private(node, "channel_type", "serial") == "udp" else 10.0
        self._scan_hz = private(node, "scan_frequency", usual_hz)
        if not 0 < self._scan_hz < 1000:
            log.error("~scan_frequency must be > 0 and < 1000, got %s: using %s", self._scan_hz, usual_hz)
            self._scan_hz = usual_hz
        self._is_on = threading.Event()
        self._is_on.set()
        self._scan: type[LaserScan] = load_message_class("sensor_msgs/LaserScan")
        self._publisher = node.advertise("scan", self._scan, queue_size=QUEUE_SIZE)
        self._empty: Any = load_service_class("std_srvs/Empty")
        node.serve("start_motor", self._empty, lambda _: self._switch(True))
        node.serve("stop_motor", self._empty, lambda _: self._switch(False))

    def run(self) -> int:
        """Publish until the node is shut down, and return the exit code."""
        return self._driver.run()

    def _switch(self, is_on: bool) -> Any:
        (self._is_on.set if is_on else self._is_on.clear)()
        return self._empty._response_class()

    def _session(self, stream: Stream) -> None:
        lidar = Lidar(stream, self._port.name, lambda: self._driver.is_ending)
        if self._resets:
            lidar.reset()
        mode = self._ready_mode(lidar)
        while not self._driver.is_ending:
            if not self._is_on.is_set():
                lidar.read()
                continue
            try:
                self._publish_scans(lidar, mode)
            finally:
                with suppress(DeviceError):
                    lidar.turn_motor(0)
                    lidar.stop()

    def _ready_mode(self, lidar: Lidar) -> Mode:
        """Log the device's information. Return the scan mode in `~scan_mode`, or the default mode."""
        info, (status, code) = lidar.info, lidar.health()
        if status >= 2:
            raise DeviceError(f"{lidar.name} reports an internal error (code {code:#06x}); power-cycle it")
        modes, typical = lidar.modes()
        names = [mode.name for mode in modes]
        if self._mode and self._mode not in names:
            raise DeviceError(
                f"{lidar.name} has no scan mode {self._mode}. ~scan_mode can be {', '.join(names)}"
            )
        chosen = [mode for mode in modes if mode.name == (self._mode or mode.name)]
        mode = next((each for each in chosen if self._mode or each.number == typical), None)
        if mode is None or mode.sample_us <= 0:
            raise DeviceError(f"{lidar.name} has no valid scan mode {self._mode or typical}")
        self._driver.describe(
            f"RPLIDAR {info.model:#04x}, serial number {info.serial}, firmware {info.firmware[0]}."
            f"{info.firmware[1]:02}, hardware {info.hardware}, "
            f"{f'problem {code:#06x}' if status else 'good health'}, "
            f"scan mode {mode.name}: {1000 / mode.sample_us:.1f} kHz, up to {mode.max_distance_m:.1f} m"
        )
        return mode

    def _publish_scans(self, lidar: Lidar, mode: Mode) -> None:
        """Publish scans until `stop_motor` is called or the node is shut down."""
        lidar.turn_motor(self._scan_hz)
        decoder, turns = lidar.start(mode), TurnCollector()
        began_ns, last_s = self._node.clock.now_ns(), time.monotonic()
        while self._is_on.is_set() and not self._driver.is_ending:
            for segment in decoder.feed(lidar.read()):
                turn = turns.add(segment)
                if turn:
                    now_ns, last_s = self._node.clock.now_ns(), time.monotonic()
                    self._publish(turn, mode, began_ns, now_ns)
                    self._driver.report_data()
                    began_ns = now_ns
            if time.monotonic() - last_s > SILENCE_S:
                raise DeviceError(f"{self._port.name} sends no whole turns; the head may be blocked")

    def _publish(self, turn: Sequence[Point], mode: Mode, began_ns: int, end_ns: int) -> None:
        cells = cells_per_degree(mode.sample_us, self._scan_hz) if self._is_regular else None
        sweep = sweep_of(turn, cells, is_inverted=self._is_inverted)
        steps, took_s = max(len(sweep.ranges) - 1, 1), (end_ns - began_ns) / NS_PER_S
        scan = self._scan(
            angle_min=sweep.angle_min,
            angle_max=sweep.angle_max,
            angle_increment=(sweep.angle_max - sweep.angle_min) / steps,
            time_increment=took_s / steps,
            scan_time=took_s,
            range_min=RANGE_MIN_M,
            range_max=mode.max_distance_m,
            ranges=sweep.ranges,
            intensities=sweep.intensities,
        )
        scan.header.frame_id, scan.header.stamp = self._frame, Time(*divmod(began_ns, NS_PER_S))
        self._publisher.publish(scan)


def _port(node: Node, log: logging.Logger) -> DevicePort[Stream]:
    """Return the port specified by the parameters."""
    kind = private(node, "channel_type", "serial")
    if kind == "tcp":
        return network_port(private(node, "tcp_ip", "192.168.0.7"), private(node, "tcp_port", 20108))
    if kind == "udp":
        host, number = private(node, "udp_ip", "192.168.11.2"), private(node, "udp_port", 8089)
        return network_port(host, number, socket.SOCK_DGRAM)
    if kind != "serial":
        log.error("~channel_type must be serial, tcp or udp, got %s: using serial", kind)
    return serial_port(private(node, "serial_port", "/dev/ttyUSB0"), private(node, "serial_baudrate", 115200))


@exits_after_ctrl_c()
def main(argv: Sequence[str] | None = None) -> int:
    """Run `rplidarNode` until the node is shut down. Return the exit code."""
    with roscpp_program("rplidar_node", "rplidar_ros", argv) as (node, log):
        try:
            return RplidarNode(node, log).run()
        except MissingExtra as error:
            log.critical("%s", error)
            return 1
