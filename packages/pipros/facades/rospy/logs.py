"""`rospy.loginfo` and similar functions.

All messages are passed to Python's logger `rosout` (or `rosout.<logger_name>`), whose handlers write to the
console, the log file and the topic `/rosout`. Each record includes the caller's source location.
"""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Hashable
from typing import Any, NamedTuple, Protocol

from pipros.msg import time as msg_time
from pipros.node.log import ros_logger
from rospy.rostime import get_time, in_seconds
from rospy.session import session

DEBUG, INFO, WARN, ERROR, FATAL = 1, 2, 4, 8, 16
"""The level numbers used on `/rosout` and in `init_node(log_level=)`."""


class Log(Protocol):
    """Function that logs `msg % args`, or `msg` if there are no args.

    `logger_name` names a logger below `rosout`. Returns whether the node has started and `msg` was passed to
    the logger.
    """

    def __call__(self, msg: object, *args: Any, **kwargs: Any) -> bool: ...


class LogThrottled(Protocol):
    """Function that logs at most one line per `period` seconds from each place in the code."""

    def __call__(self, period: float | msg_time.Duration, msg: object, *args: Any, **kwargs: Any) -> bool: ...


class Family(NamedTuple):
    """Log functions for one level."""

    log: Log
    throttle: LogThrottled
    throttle_identical: LogThrottled
    once: Log


class LoggingThrottle:
    """Filter that accepts one line per period from each caller.

    Attributes:
        last_logging_time_table: time at which each caller last logged a line, in seconds on the node's clock.
    """

    def __init__(self) -> None:
        self.last_logging_time_table: dict[Hashable, float] = {}

    def __call__(self, caller_id: Hashable, period: float | msg_time.Duration) -> bool:
        """Return True if this caller has not logged a line for `period`, or if the clock moved backwards."""
        now = get_time() if session.has_time else time.time()
        last = self.last_logging_time_table.get(caller_id)
        if last is not None and last <= now <= last + in_seconds(period):
            return False
        if last is not None and last > now:
            self.last_logging_time_table.clear()
        self.last_logging_time_table[caller_id] = now
        return True


class LoggingIdentical:
    """Filter that accepts a caller's line if it differs from the caller's previous line.

    Attributes:
        last_logging_msg_table: the last line of each caller.
    """

    def __init__(self) -> None:
        self.last_logging_msg_table: dict[Hashable, str] = {}

    def __call__(self, caller_id: Hashable, msg: str) -> bool:
        """Return True if the caller's previous line was different, or if there was none."""
        is_new = self.last_logging_msg_table.get(caller_id) != msg
        self.last_logging_msg_table[caller_id] = msg
        return is_new


class LoggingOnce:
    """Filter that accepts one line per caller.

    Attributes:
        called_caller_ids: IDs of the callers that have already logged a line.
    """

    def __init__(self) -> None:
        self.called_caller_ids: set[Hashable] = set()

    def __call__(self, caller_id: Hashable) -> bool:
        """Return True on the caller's first call."""
        is_new = caller_id not in self.called_caller_ids
        self.called_caller_ids.add(caller_id)
        return is_new


# The tables are separate, so that calls of different kinds on the same line do not affect each other.
_logging_once, _logging_throttle, _logging_identical, _logging_identical_throttle = (
    LoggingOnce(),
    LoggingThrottle(),
    LoggingIdentical(),
    LoggingThrottle(),
)


def _caller() -> tuple[str, int, int]:
    """Return the file and line where a log function was called, and the position of the call in the line."""
    frame = sys._getframe(2)
    return frame.f_code.co_filename, frame.f_lineno, frame.f_lasti


def _logger(kwargs: dict[str, Any]) -> logging.Logger:
    kwargs["stacklevel"] = kwargs.get("stacklevel", 1) + 1  # past the functions of this module
    name = kwargs.pop("logger_name", None)
    return ros_logger(f"rosout.{name}") if name else session.logger


def _family(level: int) -> Family:
    def log(msg: object, *args: Any, **kwargs: Any) -> bool:
        """Log `msg % args` at the function's level. `logger_name` names a logger below `rosout`."""
        _logger(kwargs).log(level, msg, *args, **kwargs)
        return session.node is not None

    def throttle(period: float | msg_time.Duration, msg: object, *args: Any, **kwargs: Any) -> bool:
        """Log unless this place in the code logged less than `period` seconds ago on the node's clock."""
        logger = _logger(kwargs)
        if _logging_throttle(_caller(), period):
            logger.log(level, msg, *args, **kwargs)
            return session.node is not None
        return False

    def throttle_identical(period: float | msg_time.Duration, msg: object, *args: Any, **kwargs: Any) -> bool:
        """Like `throttle`, but always log if `msg`, without its args, differs from this place's last one."""
        logger = _logger(kwargs)
        caller = _caller()
        is_due = _logging_identical_throttle(caller, period)
        if _logging_identical(caller, str(msg)) or is_due:
            logger.log(level, msg, *args, **kwargs)
            return session.node is not None
        return False

    def once(msg: object, *args: Any, **kwargs: Any) -> bool:
        """Log only the first time that this place in the code is reached."""
        logger = _logger(kwargs)
        if _logging_once(_caller()):
            logger.log(level, msg, *args, **kwargs)
            return session.node is not None
        return False

    return Family(log, throttle, throttle_identical, once)


logdebug, logdebug_throttle, logdebug_throttle_identical, logdebug_once = _family(logging.DEBUG)
loginfo, loginfo_throttle, loginfo_throttle_identical, loginfo_once = _family(logging.INFO)
logwarn, logwarn_throttle, logwarn_throttle_identical, logwarn_once = _family(logging.WARNING)
logerr, logerr_throttle, logerr_throttle_identical, logerr_once = _family(logging.ERROR)
logfatal, logfatal_throttle, logfatal_throttle_identical, logfatal_once = _family(logging.CRITICAL)
logout = loginfo
logerror = logerr
