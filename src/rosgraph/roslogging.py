"""`rosgraph.roslogging`: log files of programs that are not nodes, and the console handler of ROS."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipros.env import Environment
from pipros.errors import PiprosError
from pipros.lazy_names import star_names as _star_names
from pipros.node.log import ConsoleHandler, RosLogger, find_log_config
from pipros.node.program_log import link_latest, log_program, make_folders_as_parent

_star_names(__name__, "datetime inspect rospkg time yaml")

ROS_LOG_DIR = "ROS_LOG_DIR"


class LoggingException(Exception):  # the name that ROS code catches
    """Logging could not be configured."""


class RospyLogger(RosLogger, logging.getLoggerClass()):  # type: ignore[misc]  # whatever others have set
    """The class of loggers that are made after this module was imported, as in Noetic."""


logging.setLoggerClass(RospyLogger)


class RosStreamHandler(ConsoleHandler):
    """Writes in the format of `ROSCONSOLE_FORMAT`: DEBUG and INFO to stdout, the rest to stderr."""

    def __init__(self, colorize: bool = True, stdout: Any = None, stderr: Any = None) -> None:
        """`stdout` and `stderr` are written to in place of the process's own."""
        super().__init__(
            "",
            lambda: None,
            os.environ.get("ROSCONSOLE_FORMAT"),
            is_coloured=colorize,
            stdout=stdout,
            stderr=stderr,
        )

    def emit(self, record: logging.LogRecord) -> None:
        rospy: Any = sys.modules.get("rospy.session")  # a configuration is read before there is a node
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
    """Has Python's logging write to a file in the folder of ROS' logs, and to what a configuration file says.

    Args:
        logname: the logger of the program, and the beginning of the file's name.
        level: what is written.
        filename: in place of `<logname>-<pid>.log`.
        env: in place of the environment of the process.

    Returns:
        The path of the log file; None when there is no folder for it, which is said on stderr.

    Raises:
        LoggingException: a file is in the place of the folder, or what `ROS_PYTHON_LOG_CONFIG_FILE` names
            cannot be used.
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
    """Makes a folder and those above it, each with owner and mode of the one that it lies in.

    So folders that root makes in the home of a user are the user's.

    Raises:
        OSError: one cannot be made.
    """
    make_folders_as_parent(Path(p))


def renew_latest_logdir(logfile_dir: str) -> bool:
    """Points the link `latest` beside a folder of logs to it; False when `latest` is not a link.

    Raises:
        OSError: the link cannot be made.
    """
    return link_latest(Path(logfile_dir))
