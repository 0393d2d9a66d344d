"""`rosrun diagnostic_common_diagnostics sensors_monitor.py`: reports temperatures and fans."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import rospy
from diagnostic_common_diagnostics.nodes.monitor import init, psutil, run_updater
from pipros.diagnostics.machine import Report, Sensor, sensors_report


def readings(source: Any) -> Iterator[Sensor]:
    """What psutil reads; nothing on systems whose sensors it does not know."""
    for chip, found in getattr(source, "sensors_temperatures", dict)().items():
        for item in found:
            yield Sensor(item.label or chip, "Temperature", item.current, item.high, item.critical)
    for chip, found in getattr(source, "sensors_fans", dict)().items():
        for item in found:
            yield Sensor(item.label or chip, "Speed", item.current)


def main() -> int:
    """Runs until the node is ended. Returns the exit code."""
    source = psutil()
    host = init("sensors_monitor")
    ignore_fans = bool(rospy.get_param("~ignore_fans", False))
    rospy.loginfo("Ignore fanspeed warnings: %s", ignore_fans)

    def read() -> Report:
        return sensors_report(readings(source), ignore_fans=ignore_fans)

    return run_updater(f"{host} Sensor Status", "none", read, 1.0)
