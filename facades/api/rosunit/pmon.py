"""Processes and their monitor: `roslaunch.pmon` under rosunit's names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pipros.basics.lazy_names import star_names as _star_names
from roslaunch import nodeprocess, pmon
from roslaunch.pmon import DeadProcess, ProcessListener, ProcessMonitor
from rosunit.core import printerrlog, printlog, printlog_bold

__all__ = [
    "DeadProcess",
    "FatalProcessLaunch",
    "LocalProcess",
    "PmonException",
    "Process",
    "ProcessListener",
    "ProcessMonitor",
    "pmon_shutdown",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "shutdown_process_monitor",
    "start_process_monitor",
]

_star_names(
    __name__,
    "atexit queue:Empty threading:Lock queue:Queue threading:RLock threading:Thread time traceback",
)

pmon_shutdown = pmon.pmon_shutdown
shutdown_process_monitor = pmon.shutdown_process_monitor
start_process_monitor = pmon.start_process_monitor


class PmonException(Exception):
    """A process cannot be monitored or started."""


class FatalProcessLaunch(PmonException):
    """A process cannot be started, and a retry would fail as well."""


class Process(pmon.Process):
    """Base class of the processes of a `ProcessMonitor`; subclasses implement starting and stopping."""

    def __init__(
        self,
        package: str,
        name: str,
        args: Sequence[str],
        env: Any,
        respawn: bool = False,
        required: bool = False,
    ) -> None:
        super().__init__(package, name, args, env, respawn, required=required)


class LocalProcess(nodeprocess.LocalProcess):
    """A program on this computer, for `rosunit.baretest.LocalProcess`."""

    def __init__(
        self,
        run_id: str | None,
        package: str,
        name: str,
        args: Sequence[str],
        env: Mapping[str, str],
        log_output: bool,
        respawn: bool = False,
        required: bool = False,
        cwd: str | None = None,
        is_node: bool = True,
    ) -> None:
        super().__init__(
            run_id or "",
            package,
            name,
            args,
            env,
            log_output,
            respawn,
            required=required,
            cwd=cwd,
            is_node=is_node,
        )
