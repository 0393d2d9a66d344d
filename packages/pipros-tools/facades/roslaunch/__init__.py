"""Drop-in replacement for the Python API of Noetic's roslaunch, based on `pipros_tools.launch`."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from pipros.basics.env import DEFAULT_MASTER_PORT, Environment
from pipros.basics.lazy_names import lazy_names as _lazy_names
from pipros.basics.replaced_file import write_whole as _write_whole
from roslaunch import (
    config,
    core,
    launch,
    loader,
    nodeprocess,
    parent,
    pmon,
    rlutil,
    scriptapi,
    substitution_args,
    xmlloader,
)
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import Machine, Master, Node, Param, RLException, Test
from roslaunch.launch import ROSLaunchRunner
from roslaunch.nodeprocess import DEFAULT_TIMEOUT_SIGINT, DEFAULT_TIMEOUT_SIGTERM, NUM_WORKERS
from roslaunch.pmon import Process
from roslaunch.scriptapi import ROSLaunch
from roslaunch.xmlloader import XmlLoader, XmlParseException

NAME = "roslaunch"

__all__ = [
    "DEFAULT_MASTER_PORT",
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "NAME",
    "NUM_WORKERS",
    "Machine",
    "Master",
    "Node",
    "Param",
    "Process",
    "RLException",
    "ROSLaunch",
    "ROSLaunchConfig",
    "ROSLaunchRunner",
    "Test",
    "XmlLoader",
    "XmlParseException",
    "config",
    "configure_logging",
    "core",
    "handle_exception",
    "launch",
    "loader",
    "main",
    "nodeprocess",
    "parent",
    "pmon",
    "rlutil",
    "scriptapi",
    "substitution_args",
    "write_pid_file",
    "xmlloader",
]


def configure_logging(uuid: str) -> None:
    """Do nothing: the launcher opens its log file itself."""
    _ = uuid


def write_pid_file(options_pid_fn: str | None, options_core: bool, port: int | None) -> None:
    """Write the process ID to the given file. A core writes to `~/.ros/roscore-PORT.pid` by default."""
    file = options_pid_fn and os.path.expanduser(options_pid_fn)
    if not file and options_core:
        file = str(Environment.from_os().ros_home / f"roscore-{port or DEFAULT_MASTER_PORT}.pid")
    if file:
        _write_whole(Path(file), str(os.getpid()).encode())


def handle_exception(roslaunch_core: Any, logger: Any, msg: str, e: Exception) -> NoReturn:
    """Print an error with `roslaunch_core.printerrlog`, log the traceback, and exit with code 1."""
    roslaunch_core.printerrlog(msg + str(e))
    roslaunch_core.printerrlog("The traceback for the exception was written to the log file")
    if logger:
        logger.error(traceback.format_exc())
    sys.exit(1)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command `roslaunch`, and return the exit code.

    `argv` starts with the program's name, like `sys.argv`.
    """
    from pipros_tools.cli.roslaunch import main as run

    return run(None if argv is None else list(argv)[1:])


__getattr__, __dir__ = _lazy_names(__name__, {}, ("depends", "param_dump"))
