"""`rosrun diagnostic_common_diagnostics cpu_monitor.py`: report the processor load."""

from __future__ import annotations

from diagnostic_common_diagnostics.nodes.monitor import init, number, psutil, run_updater
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.diagnostics.machine import Averages, Report, cpu_report


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    source = psutil()
    host = init("cpu_monitor")
    warning, averages = number("~warning_percentage", 90), Averages(int(number("~window", 1)))
    # each call returns the load since the previous call, so the first result is meaningless
    source.cpu_percent(percpu=True)

    def read() -> Report:
        return cpu_report(averages.add(source.cpu_percent(percpu=True)), warning)

    return run_updater("CPU Information", host, read, number("~rate", 1))
