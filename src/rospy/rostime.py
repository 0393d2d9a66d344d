"""`rospy.Time` and `rospy.Duration`: genpy's, with a clock."""

from __future__ import annotations

import threading
import time

from pipros.lazy_names import star_names as _star_names
from pipros.msg import time as msg_time
from pipros.msg.time import NS_PER_S
from pipros.node.clock import Clock, SimulatedClock
from pipros.shared_names import share_names
from rospy.exceptions import ROSInitException
from rospy.session import session

_star_names(__name__, "genpy rospy sys traceback")


def clock() -> Clock:
    """The clock of the default node.

    Raises:
        ROSInitException: before init_node, unless `set_rostime_initialized(True)` was called.
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
    """The time of the node's clock in seconds.

    Raises:
        ROSInitException: before init_node.
    """
    return clock().now_ns() / NS_PER_S


_condition = threading.Condition()


def get_rostime_cond() -> threading.Condition:
    """A condition that is notified when simulated time changes; nothing notifies it in wall time."""
    clock = session.clock
    return clock.changed if isinstance(clock, SimulatedClock) else _condition


def is_rostime_initialized() -> bool:
    return session.has_time


def is_wallclock() -> bool:
    """True unless the node runs on simulated time."""
    return not session.clock.is_simulated


def set_rostime_initialized(val: bool) -> None:
    """Whether there is a time to ask for. For tests without a node: `init_node` sees to it for others."""
    session.has_time = val


def _set_rostime(t: msg_time.Time) -> None:
    """Sets what `Time.now` answers; from then on time is simulated."""
    session.simulate_time(t.to_nsec())


def switch_to_wallclock() -> None:
    """Goes back to the clock of the machine."""
    session.use_wall_clock()


def wallsleep(duration: float | msg_time.Duration) -> None:
    """Sleeps in wall time, even if the node uses simulated time."""
    time.sleep(max(0.0, in_seconds(duration)))


def in_seconds(duration: float | msg_time.Duration) -> float:
    """A duration or a number of seconds as the latter."""
    return duration.to_sec() if isinstance(duration, msg_time.Duration) else duration


share_names(__name__, session, {"_rostime_initialized": "has_time"})
