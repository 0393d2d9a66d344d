"""Reports on a machine, with a level, a message, and values under Noetic's names.

This module performs no I/O. The programs in `facades/api/diagnostic_common_diagnostics/nodes` provide the
readings.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pipros.basics.errors import PiprosError
from pipros_libraries.diagnostics.items import ERROR, OK, WARN, level_name
from pipros_libraries.diagnostics.summaries import merged

HOT, CRITICALLY_HOT = 55.0, 70.0
"""Temperatures in degrees Celsius above which a disk counts as hot or critically hot."""

LITTLE, VERY_LITTLE = 5, 1
"""Free disk space in GiB, at or below which to report a warning or an error."""

SMALL_DISK = 10
"""Minimum disk size in GiB. Smaller disks are ignored."""

_HEAT = ("OK", "Hot", "Critical Hot")
_SPACE = ("OK", "Low Disk Space", "Very Low Disk Space")


class BadReading(PiprosError, ValueError):
    """A response from a device or a server is invalid."""


@dataclass(frozen=True, slots=True)
class Report:
    """The level, message and values of a status."""

    level: int
    message: str
    values: Sequence[tuple[str, str]] = ()


class Averages:
    """Moving averages of several quantities.

    >>> averages = Averages(2)
    >>> [averages.add([10.0, 1.0]), averages.add([20.0, 1.0]), averages.add([40.0, 1.0])]
    [[10.0, 1.0], [15.0, 1.0], [30.0, 1.0]]
    """

    def __init__(self, window: int) -> None:
        """Average over the last `window` readings. A window below 1 counts as 1."""
        self._readings: deque[Sequence[float]] = deque(maxlen=max(1, window))

    def add(self, reading: Sequence[float]) -> list[float]:
        self._readings.append(reading)
        return [sum(column) / len(column) for column in zip(*self._readings, strict=False)]


def cpu_report(loads: Sequence[float], warning: float) -> Report:
    """Return the report on processor loads in percent: a warning if any load exceeds `warning`."""
    average = sum(loads) / len(loads) if loads else 0.0
    values = [("CPU Load Average", f"{average:.2f}")]
    values += [(f"CPU {number} Load", f"{load:.2f}") for number, load in enumerate(loads)]
    if any(load > warning for load in loads):
        return Report(WARN, f"At least one CPU exceeds {warning:g} percent", values)
    return Report(OK, f"CPU Average {average:.2f} percent", values)


def ram_report(used: float, warning: float) -> Report:
    """Return the report on memory usage in percent: a warning if the usage exceeds `warning`."""
    values = [("RAM Load Average", f"{used:.2f}")]
    if used > warning:
        return Report(WARN, f"RAM Average exceeds {warning:g} percent", values)
    return Report(OK, f"RAM Average {used:.2f} percent", values)


@dataclass(frozen=True, slots=True)
class DiskHeat:
    """A disk: device, model, and temperature in degrees Celsius (None if the disk is asleep)."""

    device: str
    model: str
    degrees: float | None


def heat_report(disks: Sequence[DiskHeat], *, warns: bool = True) -> Report:
    """Return the report on disk temperatures. Its level is ERROR if there are no disks.

    If `warns` is false, the level does not depend on the temperatures.
    """
    level, values = OK, list[tuple[str, str]]()
    for number, disk in enumerate(disks):
        heat = disk.degrees if disk.degrees is not None else 0.0
        of_disk = ERROR if heat > CRITICALLY_HOT else WARN if heat > HOT else OK
        level = max(level, of_disk)
        values += [
            (f"Disk {number} Temp Status", _HEAT[of_disk]),
            (f"Disk {number} Mount Pt.", disk.device),
            (f"Disk {number} Device ID", disk.model),
            (f"Disk {number} Temp", "SLP" if disk.degrees is None else f"{disk.degrees:g}"),
        ]
    if not disks:
        return Report(ERROR, "No disk reports its temperature: start hddtemp, or load the module drivetemp")
    return Report(level if warns else OK, _HEAT[level] if warns else "OK", values)


def parsed_hddtemp(answer: str) -> list[DiskHeat]:
    """Parse the disks in a response from the hddtemp daemon, such as `|/dev/sda|WDC 10|41|C|`.

    Raises:
        BadReading: the response has a different format.
    """
    if not answer:
        return []
    fields = answer.strip("|").split("|")
    disks = []
    for start in range(0, len(fields), 5):  # disks are separated by an empty field
        match fields[start : start + 4]:
            case [device, model, degrees, unit]:
                value = float(degrees) if degrees.isdecimal() else None
                if value is not None and unit == "F":
                    value = (value - 32) / 1.8
                disks.append(DiskHeat(device, model, value))
            case _:
                raise BadReading(
                    "hddtemp's response must have the form |device|model|temperature|unit|, got "
                    f"{answer[:200]!r}"
                )
    return disks


@dataclass(frozen=True, slots=True)
class DiskSpace:
    """A mounted disk. Sizes are in GiB."""

    name: str
    mount_point: str
    size: int
    available: int


def space_report(disks: Iterable[DiskSpace]) -> Report:
    """Return the report on free disk space. Disks smaller than `SMALL_DISK` are omitted."""
    level, values = OK, [("Disk Space Reading", "OK")]
    large = [disk for disk in disks if disk.size >= SMALL_DISK]
    for number, disk in enumerate(large, 1):
        of_disk = OK if disk.available > LITTLE else WARN if disk.available > VERY_LITTLE else ERROR
        level = max(level, of_disk)
        values += [
            (f"Disk {number} Name", disk.name),
            (f"Disk {number} Available", str(disk.available)),
            (f"Disk {number} Size", str(disk.size)),
            (f"Disk {number} Status", level_name(of_disk)),
            (f"Disk {number} Mount Point", disk.mount_point),
        ]
    return Report(level, _SPACE[level], values)


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor reading, and the sensor's limits in the same unit; None for no limit.

    The kind is `Temperature` (in degrees Celsius), `Voltage` (in V), or `Speed` (of a fan, in rpm).
    """

    name: str
    kind: str
    value: float
    high: float | None = None
    critical: float | None = None
    low: float | None = None


def sensors_report(sensors: Iterable[Sensor], *, ignore_fans: bool = False) -> Report:
    """Return the report on the mainboard's sensors."""
    level, message, values = OK, "OK", list[tuple[str, str]]()
    for sensor in sensors:
        values.append((f"{sensor.name} {sensor.kind}", f"{sensor.value:g}"))
        found = OK, ""
        if sensor.kind == "Temperature" and _is_above(sensor.value, sensor.critical):
            found = ERROR, "Critical Temperature"
        elif sensor.kind == "Temperature" and _is_above(sensor.value, sensor.high):
            found = WARN, "High Temperature"
        elif sensor.kind == "Voltage" and sensor.low is not None and sensor.value < sensor.low:
            found = ERROR, "Low Voltage"
        elif sensor.kind == "Voltage" and _is_above(sensor.value, sensor.high):
            found = ERROR, "High Voltage"
        elif sensor.kind == "Speed" and not ignore_fans and sensor.value <= 0:
            found = ERROR, "No Fan Speed"
        if found[0] != OK:
            level, message = merged(level, message, *found)
    return Report(level, message, values)


def _is_above(value: float, limit: float | None) -> bool:
    return limit is not None and limit > 0 and value > limit


def ntp_report(offset_us: float, tolerance_us: float, error_us: float) -> Report:
    """Return the report on the offset of a server's clock from the local clock. Times are in microseconds."""
    values = [
        ("Offset (us)", f"{offset_us:.0f}"),
        ("Offset tolerance (us)", f"{tolerance_us:g}"),
        ("Offset tolerance (us) for Error", f"{error_us:g}"),
    ]
    off = abs(offset_us)
    level = ERROR if off > error_us else WARN if off > tolerance_us else OK
    return Report(level, "OK" if level == OK else "NTP Offset Too High", values)


def ntp_failure(reason: str, tolerance_us: float, error_us: float) -> Report:
    """Return the report for a server that did not respond correctly."""
    values = [
        ("Offset (us)", "N/A"),
        ("Offset tolerance (us)", f"{tolerance_us:g}"),
        ("Offset tolerance (us) for Error", f"{error_us:g}"),
        ("Errors", reason),
    ]
    return Report(ERROR, f"Error asking for the time: {reason}", values)
