"""`rospy.Time` and `rospy.Duration`: genpy's, with a clock."""

from __future__ import annotations

import time

import genpy
from pipros.node.clock import NS_PER_S, Clock
from rospy.exceptions import ROSInitException
from rospy.session import session


def clock() -> Clock:
    """The clock of the default node.

    Raises:
        ROSInitException: before init_node.
    """
    if session.node is None or not session.has_time:
        raise ROSInitException("time is not initialized. Have you called init_node()?")
    return session.node.clock


class Duration(genpy.Duration):
    """A length of time: `secs` and `nsecs`. See `genpy.Duration` for its arithmetic."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"rospy.Duration[{self.to_nsec()}]"


class Time(genpy.Time):
    """A point in time: `secs` and `nsecs` since the epoch. See `genpy.Time` for its arithmetic."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"rospy.Time[{self.to_nsec()}]"

    @staticmethod
    def now() -> Time:
        """The time of the node's clock: zero while a simulated clock has not started.

        Raises:
            ROSInitException: before init_node.
        """
        return get_rostime()

    @classmethod
    def from_seconds(cls, float_secs: float) -> Time:
        """The same as `from_sec`, which new code should use."""
        return cls.from_sec(float_secs)


def get_rostime() -> Time:
    """The same as `Time.now`."""
    return Time(*divmod(clock().now_ns(), NS_PER_S))


def get_time() -> float:
    """The time of the node's clock in seconds."""
    return clock().now_ns() / NS_PER_S


def is_rostime_initialized() -> bool:
    return session.has_time


def is_wallclock() -> bool:
    """True unless the node runs on simulated time."""
    return session.node is None or not session.node.clock.is_simulated


def wallsleep(duration: float | genpy.Duration) -> None:
    """Sleeps in wall time, whatever clock the node runs on."""
    time.sleep(max(0.0, duration.to_sec() if isinstance(duration, genpy.Duration) else duration))
