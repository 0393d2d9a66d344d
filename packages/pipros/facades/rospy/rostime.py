"""`rospy.Time` and `rospy.Duration`: genpy's classes, plus the node's clock."""

from __future__ import annotations

import threading
import time

from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.shared_names import share_names
from pipros.msg import time as msg_time
from pipros.msg.time import NS_PER_S
from pipros.node.clock import Clock, SimulatedClock
from rospy.exceptions import ROSInitException
from rospy.session import session

_star_names(__name__, "genpy rospy sys traceback")


def clock() -> Clock:
    """Return the clock of the default node.

    Raises:
        ROSInitException: init_node has not been called, unless `set_rostime_initialized(True)` was called.
    """
    if not session.has_time:
        raise ROSInitException("time is not initialized. Have you called init_node()?")
    return session.clock


class Duration(msg_time.Duration):
    """A length of time: `secs` and `nsecs`. See `genpy.Duration` for its arithmetic."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"rospy.Duration[{self.to_nsec()}]"


class Time(msg_time.Time):
    """A point in time: `secs` and `nsecs` since the epoch. See `genpy.Time` for its arithmetic."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"rospy.Time[{self.to_nsec()}]"

    @staticmethod
    def now() -> Time:
        """Return the node's current time; zero if a simulated clock has not started.

        Raises:
            ROSInitException: init_node has not been called.
        """
        return get_rostime()

    @classmethod
    def from_seconds(cls, float_secs: float) -> Time:
        """Same as `from_sec`, which new code should use."""
        return cls.from_sec(float_secs)


def get_rostime() -> Time:
    """Same as `Time.now`."""
    return Time(*divmod(clock().now_ns(), NS_PER_S))


def get_time() -> float:
    """Return the node's current time in seconds.

    Raises:
        ROSInitException: init_node has not been called.
    """
    return clock().now_ns() / NS_PER_S


_condition = threading.Condition()


def get_rostime_cond() -> threading.Condition:
    """Return a condition that is notified when simulated time changes.

    If the node uses wall time, the condition is never notified.
    """
    clock = session.clock
    return clock.changed if isinstance(clock, SimulatedClock) else _condition


def is_rostime_initialized() -> bool:
    return session.has_time


def is_wallclock() -> bool:
    """Return True unless the node uses simulated time."""
    return not session.clock.is_simulated


def set_rostime_initialized(val: bool) -> None:
    """Set whether time is available. Intended for tests without a node; `init_node` does this itself."""
    session.has_time = val


def _set_rostime(t: msg_time.Time) -> None:
    """Set the result of `Time.now`, and switch to simulated time."""
    session.set_sim_time(t.to_nsec())


def switch_to_wallclock() -> None:
    """Switch to wall time."""
    session.use_wall_clock()


def wallsleep(duration: float | msg_time.Duration) -> None:
    """Sleep for a wall-clock duration, even if the node uses simulated time."""
    time.sleep(max(0.0, in_seconds(duration)))


def in_seconds(duration: float | msg_time.Duration) -> float:
    """Convert a duration to seconds. Numbers are interpreted as seconds; NaN is a ValueError."""
    if duration != duration:  # no wait would end; the text is Python's
        raise ValueError("Invalid value NaN (not a number)")
    return duration.to_sec() if isinstance(duration, msg_time.Duration) else duration


share_names(__name__, session, {"_rostime_initialized": "has_time"})
