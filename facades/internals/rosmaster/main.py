"""`rosmaster.main`: the command `rosmaster`."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import TextIO

from pipros.basics.lazy_names import star_names as _star_names
from pipros.cli.rosmaster import main as _main
from rosmaster.master import NUM_WORKERS

__all__ = ["NUM_WORKERS", "configure_logging", "rosmaster_main"]

_star_names(__name__, "logging optparse os rosmaster sys time")


def configure_logging() -> str | None:
    """Has Python's logging write to `master.log` in the folder of ROS' logs; see `rosgraph.roslogging`.

    Returns:
        The path of the log file; None when its folder cannot be made.

    Raises:
        rosgraph.roslogging.LoggingException: `ROS_PYTHON_LOG_CONFIG_FILE` cannot be used.
    """
    from rosgraph import roslogging

    return roslogging.configure_logging("rosmaster", logging.DEBUG, filename="master.log")


def rosmaster_main(
    argv: Sequence[str] | None = None, stdout: TextIO | None = None, env: Mapping[str, str] | None = None
) -> None:
    """Runs a master until it is shut down. The first argument is the name of the program.

    `stdout` and `env` are those of the process, whatever is given.
    """
    del stdout, env
    _main(None if argv is None else argv[1:])
