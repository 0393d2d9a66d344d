"""`rosrun diagnostic_common_diagnostics hd_monitor.py`: report disk temperatures and free disk space."""

from __future__ import annotations

import argparse
import contextlib
import socket
import time
from collections.abc import Callable
from typing import Any

import rospy
from diagnostic_common_diagnostics.nodes.monitor import init, psutil, publish_all
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.diagnostics.items import ERROR
from pipros_libraries.diagnostics.machine import (
    BadReading,
    DiskHeat,
    DiskSpace,
    Report,
    heat_report,
    parsed_hddtemp,
    space_report,
)

HDDTEMP = ("127.0.0.1", 7634)
HDDTEMP_DEADLINE_S = 2.0
HDDTEMP_LIMIT_BYTES = 64 * 1024
TEMPERATURE_S, SPACE_S = 10.0, 5.0
_GIGABYTE = 2**30
_DISK_CHIPS = ("drivetemp", "nvme")


def ask_hddtemp(address: tuple[str, int] = HDDTEMP) -> list[DiskHeat]:
    """Return the disks known to the hddtemp daemon.

    Raises:
        OSError: the daemon is not running or does not respond.
        BadReading: the response does not have hddtemp's format.
    """
    answer = b""
    with socket.create_connection(address, HDDTEMP_DEADLINE_S) as connection:
        while part := connection.recv(4096):
            answer += part
            if len(answer) > HDDTEMP_LIMIT_BYTES:
                raise BadReading(f"the response from hddtemp must have at most {HDDTEMP_LIMIT_BYTES} bytes")
    return parsed_hddtemp(answer.decode("utf-8", "replace"))


def disks_of(source: Any) -> list[DiskHeat]:
    """Return the disks whose temperature the kernel reports."""
    chips: dict[str, list[Any]] = getattr(source, "sensors_temperatures", dict)()
    return [
        DiskHeat(chip, item.label or chip, item.current)
        for chip in _DISK_CHIPS
        for item in chips.get(chip, [])
    ]


def temperatures(source: Any) -> list[DiskHeat]:
    """Return the temperatures from hddtemp if it is running, otherwise from the kernel."""
    with contextlib.suppress(OSError, BadReading):
        if disks := ask_hddtemp():
            return disks
    return disks_of(source)


def space_below(source: Any, folder: str) -> Report:
    """Return a report on the free space of the disk that contains a folder."""
    try:
        used = source.disk_usage(folder)
    except OSError as error:
        return Report(ERROR, "Error", [("Disk Space Reading", "Exception"), ("Disk Space Ex", str(error))])
    mounted = [part for part in source.disk_partitions(all=True) if _is_below(folder, part.mountpoint)]
    disk = max(mounted, key=lambda part: len(part.mountpoint), default=None)
    name, mount_point = (disk.device, disk.mountpoint) if disk is not None else ("?", folder)
    return space_report([DiskSpace(name, mount_point, -(-used.total // _GIGABYTE), used.free // _GIGABYTE)])


def _is_below(folder: str, mount_point: str) -> bool:
    return f"{folder.rstrip('/')}/".startswith(f"{mount_point.rstrip('/')}/")


class Kept:
    """Cache for a report. `report` adds the report's age, and reads a new report after `period_s` seconds."""

    def __init__(self, read: Callable[[], Report], period_s: float) -> None:
        self._read, self._period_s = read, period_s
        self._report = Report(ERROR, "No Data")
        self._read_at = -period_s

    def report(self, now_s: float) -> Report:
        if now_s - self._read_at >= self._period_s or self._read_at < 0:
            self._report, self._read_at = self._read(), now_s
        age = [("Update Status", "OK"), ("Time Since Update", str(now_s - self._read_at))]
        return Report(self._report.level, self._report.message, [*age, *self._report.values])


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    parser = argparse.ArgumentParser("hd_monitor.py", description="Reports on the disks of this machine.")
    parser.add_argument("--diag-hostname", help="Computer name in diagnostics output (ex: 'c1')")
    parser.add_argument(
        "folder", nargs="?", help="also report the free space on the disk that contains this folder"
    )
    options = parser.parse_args(rospy.myargv()[1:])
    source = psutil()
    host = init("hd_monitor")
    shown = options.diag_hostname or host
    warns = not rospy.get_param("~no_hd_temp_warn", False)
    kept = {
        f"{shown} HD Temperature": Kept(lambda: heat_report(temperatures(source), warns=warns), TEMPERATURE_S)
    }
    if options.folder is not None:
        kept[f"{shown} HD Usage"] = Kept(lambda: space_below(source, options.folder), SPACE_S)

    def reports() -> list[tuple[str, Report]]:
        now_s = time.monotonic()
        return [(name, each.report(now_s)) for name, each in kept.items()]

    return publish_all(reports, host, 1.0)
