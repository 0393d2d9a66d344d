"""`rospy.loginfo` and its family.

Everything goes to Python's logger `rosout` (or `rosout.<logger_name>`), whose handlers write to
the console, the log file and the topic `/rosout`; each line carries the caller's own place.
"""

from __future__ import annotations

import logging
import sys
import time
from typing import Any, NamedTuple, Protocol

from pipros.msg import time as msg_time
from rospy.rostime import get_time, in_seconds
from rospy.session import session

#: The levels as `/rosout` and `init_node(log_level=)` number them.
DEBUG, INFO, WARN, ERROR, FATAL = 1, 2, 4, 8, 16


class Log(Protocol):
    """Says a line: `msg % args` when there are args. `logger_name` names a logger below `rosout`."""

    def __call__(self, msg: object, *args: Any, **kwargs: Any) -> None: ...


class LogThrottled(Protocol):
    """Says a line unless this place in the code said one less than `period` seconds ago."""

    def __call__(self, period: float | msg_time.Duration, msg: object, *args: Any, **kwargs: Any) -> None: ...


class Family(NamedTuple):
    """The functions of one level."""

    log: Log
    throttle: LogThrottled
    throttle_identical: LogThrottled
    once: Log


class CallSites:
    """When each place in the code that logs with `_once` or `_throttle` last said something."""

    def __init__(self) -> None:
        self._last: dict[tuple[str, int, int], tuple[float, str]] = {}

    def is_first(self) -> bool:
        site = self._site()
        is_first = site not in self._last
        self._last[site] = 0.0, ""
        return is_first

    def is_due(self, period: float | msg_time.Duration, text: str | None = None) -> bool:
        """True when this place said nothing for a while or, given a text, says something else.

        After a clock has gone back everything is due.
        """
        site = self._site()
        now = get_time() if session.has_time else time.time()
        last, last_text = self._last.get(site, (-float("inf"), ""))
        if last <= now < last + in_seconds(period) and text in (None, last_text):
            return False
        self._last[site] = now, text or ""
        return True

    @staticmethod
    def _site() -> tuple[str, int, int]:
        """The file, the line, and the place of the call within its line."""
        frame = sys._getframe(3)  # over this method, the one above, and the function of the family
        return frame.f_code.co_filename, frame.f_lineno, frame.f_lasti


_once, _throttled, _identical = CallSites(), CallSites(), CallSites()


def _logger(kwargs: dict[str, Any]) -> logging.Logger:
    name = kwargs.pop("logger_name", None)
    return logging.getLogger(f"rosout.{name}") if name else session.logger


def _family(level: int) -> Family:
    def log(msg: object, *args: Any, **kwargs: Any) -> None:
        _logger(kwargs).log(level, msg, *args, stacklevel=2, **kwargs)

    def throttle(period: float | msg_time.Duration, msg: object, *args: Any, **kwargs: Any) -> None:
        logger = _logger(kwargs)
        if _throttled.is_due(period):
            logger.log(level, msg, *args, stacklevel=2, **kwargs)

    def throttle_identical(period: float | msg_time.Duration, msg: object, *args: Any, **kwargs: Any) -> None:
        logger = _logger(kwargs)
        if _identical.is_due(period, str(msg)):
            logger.log(level, msg, *args, stacklevel=2, **kwargs)

    def once(msg: object, *args: Any, **kwargs: Any) -> None:
        logger = _logger(kwargs)
        if _once.is_first():
            logger.log(level, msg, *args, stacklevel=2, **kwargs)

    return Family(log, throttle, throttle_identical, once)


logdebug, logdebug_throttle, logdebug_throttle_identical, logdebug_once = _family(logging.DEBUG)
loginfo, loginfo_throttle, loginfo_throttle_identical, loginfo_once = _family(logging.INFO)
logwarn, logwarn_throttle, logwarn_throttle_identical, logwarn_once = _family(logging.WARNING)
logerr, logerr_throttle, logerr_throttle_identical, logerr_once = _family(logging.ERROR)
logfatal, logfatal_throttle, logfatal_throttle_identical, logfatal_once = _family(logging.CRITICAL)
logout = loginfo
logerror = logerr
