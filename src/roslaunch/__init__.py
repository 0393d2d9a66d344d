"""`roslaunch`, the Python API that scripts of Noetic use, on top of `pipros.launch`. No logic lives here."""

from __future__ import annotations

from collections.abc import Sequence

from roslaunch import config, core, parent, pmon, rlutil, scriptapi, substitution_args, xmlloader
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import Machine, Node, Param, RLException, Test
from roslaunch.pmon import Process
from roslaunch.scriptapi import ROSLaunch
from roslaunch.xmlloader import XmlLoader, XmlParseException

NAME = "roslaunch"
DEFAULT_MASTER_PORT = 11311
NUM_WORKERS = 3
DEFAULT_TIMEOUT_SIGINT = 15.0
DEFAULT_TIMEOUT_SIGTERM = 2.0

__all__ = [
    "DEFAULT_MASTER_PORT",
    "DEFAULT_TIMEOUT_SIGINT",
    "DEFAULT_TIMEOUT_SIGTERM",
    "NAME",
    "NUM_WORKERS",
    "Machine",
    "Node",
    "Param",
    "Process",
    "RLException",
    "ROSLaunch",
    "ROSLaunchConfig",
    "Test",
    "XmlLoader",
    "XmlParseException",
    "config",
    "configure_logging",
    "core",
    "main",
    "parent",
    "pmon",
    "rlutil",
    "scriptapi",
    "substitution_args",
    "xmlloader",
]


def configure_logging(uuid: str) -> None:
    """Does nothing; for scripts that call it before they launch. The launcher opens its log file itself."""
    _ = uuid


def main(argv: Sequence[str] | None = None) -> int:
    """The command `roslaunch`; `argv` has the program's name first, as `sys.argv` does."""
    from pipros.cli.roslaunch import main as run

    return run(None if argv is None else list(argv)[1:])
