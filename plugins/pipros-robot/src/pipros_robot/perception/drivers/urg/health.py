"""The diagnostics of `urg_node`."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Final

from pipros.node import Node
from pipros_libraries.diagnostics.frequency import EventWindow, judged
from pipros_libraries.diagnostics.link_status import LinkDiagnostics, LinkLevel, LinkStatus
from pipros_libraries.nodes.params import private, private_ns
from pipros_robot.perception.drivers.urg.sensor import ScanRequest, UrgSensor

PERIOD_S: Final = 1.0
_GOOD_STATES: Final = ("Sensor works well.", "Stable 000 no error.", "sensor is working normally")
_VERSION_KEYS: Final = {
    "Vendor Name": "VEND",
    "Product Name": "PROD",
    "Firmware Version": "FIRM",
    "Protocol Version": "PROT",
    "Device ID": "SERI",
}


class LidarHealth:
    """Publishes the device's state and scan rate on `/diagnostics`.

    Attributes:
        window: counter of scans.
    """

    def __init__(self, node: Node, place: Mapping[str, str], output: str) -> None:
        """Advertise the topic. Blocks until the master answers.

        Args:
            place: the device's address as diagnostic values.
            output: name of the output whose rate is reported.
        """
        self._node, self._place, self._output = node, place, output
        self._name = node.name.removeprefix("/")
        self._tolerance = private(node, "diagnostics_tolerance", 0.05)
        reports = max(round(private_ns(node, "diagnostics_window_time", 5.0) / 1e9 / PERIOD_S), 1)
        self.window = EventWindow(reports, time.monotonic())
        self._diagnostics = LinkDiagnostics(node, "none")
        self._problem = ""
        self._sensor: UrgSensor | None = None
        self._target_hz = 0.0

    def connect(self, sensor: UrgSensor, request: ScanRequest) -> None:
        """Record that the device works."""
        self._diagnostics.hardware = sensor.version.get("SERI", "none")
        self._target_hz = 1 / (sensor.parameters.scan_s * (request.skip + 1))
        self._problem, self._sensor = "", sensor

    def disconnect(self, problem: str) -> None:
        """Record that the device does not work."""
        self._problem, self._sensor = problem, None

    def run(self) -> None:
        """Publish every second until the node is shut down."""
        while not self._node.wait_for_shutdown(PERIOD_S):
            self._diagnostics.publish([self._device(), self._rate()])

    def _device(self) -> LinkStatus:
        name, sensor = f"{self._name}: Hardware Status", self._sensor
        if sensor is None:
            problem = f": {self._problem}" if self._problem else ""
            return LinkStatus(name, LinkLevel.ERROR, f"Not Connected{problem}", self._place)
        state = sensor.state.get("STAT", "")
        values = {key: sensor.version.get(of, "") for key, of in _VERSION_KEYS.items()}
        values |= {"Device Status": state, "Scan Retrieve Error Count": str(sensor.errors)}
        is_good = state in _GOOD_STATES
        level, text = (
            (LinkLevel.OK, "Streaming") if is_good else (LinkLevel.ERROR, f"Abnormal status: {state}")
        )
        return LinkStatus(name, level, text, {**self._place, **values})

    def _rate(self) -> LinkStatus:
        count, took_s, hz = self.window.report(time.monotonic())
        low, high = ((1 + sign * self._tolerance) * self._target_hz for sign in (-1, 1))
        level, text = judged(count, hz, low, high)
        values = {
            "Events in window": f"{count}",
            "Events since startup": f"{self.window.count}",
            "Duration of window (s)": f"{took_s:f}",
            "Actual frequency (Hz)": f"{hz:f}",
            "Target frequency (Hz)": f"{self._target_hz:f}",
        }
        return LinkStatus(f"{self._name}: {self._output} topic status", LinkLevel(level), text, values)
