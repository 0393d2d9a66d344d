"""`rosmaster.main`: the command `rosmaster`."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import TextIO

from pipros_tools.cli.rosmaster import main as _main
from rosmaster.master import NUM_WORKERS

__all__ = ["NUM_WORKERS", "configure_logging", "rosmaster_main"]


def configure_logging() -> str | None:
    """Configure Python's logging to write to `master.log` in ROS's log folder; see `rosgraph.roslogging`.

    Returns:
        The path of the log file, or None if its folder cannot be created.

    Raises:
        rosgraph.roslogging.LoggingException: the log file or `ROS_PYTHON_LOG_CONFIG_FILE` cannot be used.
    """
    from rosgraph import roslogging

    return roslogging.configure_logging("rosmaster", logging.DEBUG, filename="master.log")


def rosmaster_main(
    argv: Sequence[str] | None = None, stdout: TextIO | None = None, env: Mapping[str, str] | None = None
) -> None:
    """Run a master until it is shut down. `argv` starts with the program's name.

    `stdout` and `env` are ignored; `sys.stdout` and `os.environ` are used instead.
    """
    del stdout, env
    _main(None if argv is None else argv[1:])
