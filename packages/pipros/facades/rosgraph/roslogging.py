"""`rosgraph.roslogging`: log files of programs that are not nodes, and the console handler."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.node.log import ConsoleHandler, RosLogger, find_log_config
from pipros.node.program_log import link_latest, log_program, make_folders_as_parent

ROS_LOG_DIR = "ROS_LOG_DIR"


class LoggingException(Exception):  # this is Noetic's name
    """Logging could not be configured."""


# derived from the current logger class, because another module may have set it
class RospyLogger(RosLogger, logging.getLoggerClass()):  # type: ignore[misc]
    """Class of the loggers created after this module was imported, as in Noetic."""


logging.setLoggerClass(RospyLogger)


class RosStreamHandler(ConsoleHandler):
    """Handler that formats records with `ROSCONSOLE_FORMAT`.

    DEBUG and INFO records are written to stdout, and others to stderr.
    """

    def __init__(self, colorize: bool = True, stdout: Any = None, stderr: Any = None) -> None:
        """Set up the handler. `stdout` and `stderr` replace the process's streams."""
        super().__init__(
            "",
            lambda: None,
            os.environ.get("ROSCONSOLE_FORMAT"),
            is_coloured=colorize,
            stdout=stdout,
            stderr=stderr,
        )

    def emit(self, record: logging.LogRecord) -> None:
        # None if the program configures logging without importing rospy
        rospy: Any = sys.modules.get("rospy.session")
        if rospy is not None:
            node = rospy.session.node
            self.node_name = rospy.session.name
            self.clock = lambda: node.clock if node is not None else None
        super().emit(record)


def configure_logging(
    logname: str,
    level: int = logging.INFO,
    filename: str | None = None,
    env: Mapping[str, str] | None = None,
) -> str | None:
    """Configure Python's logging to write to a file in the ROS log folder.

    A configuration file replaces these settings; see `pipros.node.log.find_log_config`.

    Args:
        logname: name of the program's logger, and prefix of the file name.
        level: minimum level to write; ignored if there is a configuration file.
        filename: file name instead of `<logname>-<pid>.log`.
        env: replacement for the process's environment.

    Returns:
        The path of the log file. If its folder cannot be created, print a message to stderr and return None.

    Raises:
        LoggingException: the folder's path is a file, the log file cannot be opened, or the configuration
            file is invalid.
    """
    environment = Environment.from_os(env)
    try:
        path = log_program(logname, level, filename, environment)
    except PiprosError as error:
        raise LoggingException(str(error)) from error
    rosout = logging.getLogger("rosout")
    if path is not None and not rosout.handlers and find_log_config(environment) is None:
        rosout.setLevel(logging.INFO)
        rosout.addHandler(RosStreamHandler())
    return None if path is None else str(path)


def makedirs_with_parent_perms(p: str) -> None:
    """Create a folder and its missing parents, each with the owner and mode of its parent.

    Therefore, folders that root creates in a user's home folder belong to the user.

    Raises:
        OSError: a folder cannot be created.
    """
    make_folders_as_parent(Path(p))


def renew_latest_logdir(logfile_dir: str) -> bool:
    """Update the link `latest` beside a log folder. Return False if `latest` exists and is not a link.

    Raises:
        OSError: the link cannot be created.
    """
    return link_latest(Path(logfile_dir))
