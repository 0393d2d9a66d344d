"""Checks for clocks and timestamps that differ."""

from __future__ import annotations

from pipros.basics.printable import listed
from pipros_tools.health.finding import Findings, error, warning
from pipros_tools.health.system_report import SystemReport

CLOCK_TOLERANCE_S = 2.0
STAMP_TOLERANCE_S = 10.0
"""Maximum difference between timestamp and clock. A few seconds are normal, because sensors and planners
stamp data with the time for which it is valid."""
_DAY_S = 86_400.0


def clocks(system: SystemReport) -> Findings:
    """Find clocks and timestamps that differ, and misconfigured simulated time."""
    publishers = [node for node in system.state.publishers.get("/clock", ()) if system.is_alive(node)]
    if system.is_time_simulated and not publishers:
        yield error(
            "no-clock",
            "/use_sim_time is set, but no node publishes /clock, so time does not advance for nodes started "
            "since",
            "Start the simulator or `rosbag play --clock`, or `rosparam set /use_sim_time false` and "
            "restart the nodes.",
            "/clock",
        )
    if publishers and not system.is_time_simulated:
        yield warning(
            "clock-unused",
            f"/clock is published by {', '.join(map(listed, publishers))}, but /use_sim_time is not set, so "
            "nodes use the wall clock",
            "Run `rosparam set /use_sim_time true` before starting the nodes.",
            "/clock",
        )
    if len(publishers) > 1:
        yield error(
            "two-clocks",
            f"Several nodes publish /clock, so time jumps: {', '.join(map(listed, publishers))}",
            "Stop all but one.",
            "/clock",
            *publishers,
        )
    offset = system.clock_offset_s
    if offset is not None and abs(offset) > CLOCK_TOLERANCE_S:
        yield error(
            "clock-differs",
            f"The clock of the master's machine is {_ahead(offset)} this machine's clock",
            "Synchronize both with NTP (chrony or systemd-timesyncd); otherwise, their timestamps cannot "
            "be compared.",
            system.master_uri,
        )
    if not system.is_time_simulated:
        for (topic, node), report in sorted(system.publishers.items()):
            ahead = report.stamp_offset_s
            if ahead is not None and abs(ahead) > STAMP_TOLERANCE_S:
                is_of_another_clock = abs(ahead) > _DAY_S
                yield warning(
                    "stamps-differ",
                    f"[{listed(node)}] stamps [{listed(topic)}] {_ahead(ahead)} this machine's clock",
                    "Stamp with rospy.Time.now(), not with the clock of a device or a simulation; if data is "
                    "played back, use simulated time (/use_sim_time and `rosbag play --clock`)."
                    if is_of_another_clock
                    else "Synchronize the clocks of both machines with NTP; if data is played back, use "
                    "simulated time (/use_sim_time and `rosbag play --clock`).",
                    topic,
                    node,
                )


def _ahead(offset_s: float) -> str:
    size = abs(offset_s)
    amount = f"{size:.0f} s" if size < 2 * _DAY_S else f"{size / _DAY_S:.0f} days"
    return f"{amount} {'ahead of' if offset_s > 0 else 'behind'}"
