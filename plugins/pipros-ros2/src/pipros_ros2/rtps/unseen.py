"""Detect ROS 2 programs that run on this machine but are not found."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from pipros_ros2.rtps.domain import Discovery, DiscoveryRange, multicast_port

_TABLE: Final = Path("/proc/net/udp")
_MAX_BYTES: Final = 1 << 20


def hint_for(discovery: Discovery, table: Path = _TABLE) -> str | None:
    """Return a hint if a program on this machine uses the domain but cannot be found, otherwise None.

    A program that announces itself only by multicast, like Humble's rmw_cyclonedds, is not found if the range
    excludes multicast. Such programs listen on the domain's multicast port, which Linux lists in `table`.
    """
    if discovery.range is not DiscoveryRange.LOCALHOST:
        return None
    try:
        with table.open("rb") as opened:
            lines = opened.read(_MAX_BYTES).splitlines()[1:]
    except OSError:  # this system is not Linux
        return None
    if multicast_port(discovery.domain) not in _ports(lines):
        return None
    return (
        f"no ROS 2 node was found, but a program on this machine uses domain {discovery.domain}. "
        "Nodes that announce themselves by multicast only, such as those of Humble with rmw_cyclonedds, "
        "are found with ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
    )


def _ports(lines: Iterable[bytes]) -> set[int]:
    """Return the local ports in the lines of /proc/net/udp."""
    found = set()
    for line in lines:
        with contextlib.suppress(IndexError, ValueError):
            found.add(int(line.split()[1].rpartition(b":")[2], 16))
    return found
