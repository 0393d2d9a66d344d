"""`rosrun diagnostic_common_diagnostics ram_monitor.py`: report the memory usage."""

from __future__ import annotations

from diagnostic_common_diagnostics.nodes.monitor import init, number, psutil, run_updater
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.diagnostics.machine import Averages, Report, ram_report


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    source = psutil()
    host = init("ram_monitor")
    warning, averages = number("~warning_percentage", 90), Averages(int(number("~window", 1)))

    def read() -> Report:
        return ram_report(averages.add([source.virtual_memory().percent])[0], warning)

    return run_updater("RAM Information", host, read, number("~rate", 1))
