"""`rosrun diagnostic_common_diagnostics sensors_monitor.py`: report temperatures, fan speeds and voltages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import rospy
from diagnostic_common_diagnostics.nodes.monitor import init, psutil, run_updater
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.diagnostics.machine import Report, Sensor, sensors_report

HWMON = Path("/sys/class/hwmon")


def readings(source: Any) -> Iterator[Sensor]:
    """Yield the temperature and fan sensors that psutil supports on this system, if any."""
    for chip, found in getattr(source, "sensors_temperatures", dict)().items():
        for item in found:
            yield Sensor(item.label or chip, "Temperature", item.current, item.high, item.critical)
    for chip, found in getattr(source, "sensors_fans", dict)().items():
        for item in found:
            yield Sensor(item.label or chip, "Speed", item.current)


def voltages(folder: Path = HWMON) -> Iterator[Sensor]:
    """Yield the voltages in V from the Linux kernel's hardware monitoring drivers.

    Yield nothing on other systems. The drivers' files contain millivolts (see
    `hwmon/sysfs-interface` in the kernel's documentation).
    """
    for path in sorted(folder.glob("hwmon*/in*_input")):
        number = path.name.removesuffix("_input")
        volts = _volts(path)
        if volts is None:
            continue
        label = _text(path.with_name(f"{number}_label")) or f"{_text(path.with_name('name'))} {number}"
        low, high = (_volts(path.with_name(f"{number}_{bound}")) for bound in ("min", "max"))
        yield Sensor(label.removesuffix(" Voltage"), "Voltage", volts, high=high, low=low)


def _volts(path: Path) -> float | None:
    try:
        return int(_text(path)) / 1000
    except ValueError:
        return None


def _text(path: Path) -> str:
    """Return the content of a kernel file.

    Return an empty string if the file does not exist or the device does not respond.
    """
    try:
        return path.read_text(encoding="utf-8").strip()
    except OSError:
        return ""


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    source = psutil()
    host = init("sensors_monitor")
    ignore_fans = bool(rospy.get_param("~ignore_fans", False))
    rospy.loginfo("Ignore fanspeed warnings: %s", ignore_fans)

    def read() -> Report:
        return sensors_report([*readings(source), *voltages()], ignore_fans=ignore_fans)

    return run_updater(f"{host} Sensor Status", "none", read, 1.0)
