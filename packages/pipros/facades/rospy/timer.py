"""`rospy.sleep`, `rospy.Rate` and `rospy.Timer`."""

from __future__ import annotations

from collections.abc import Callable

from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg import time as msg_time
from pipros.msg.time import NS_PER_S
from pipros.node import rate
from pipros.node.clock import TimeMovedBackwards
from rospy.exceptions import ROSInterruptException, ROSTimeMovedBackwardsException
from rospy.rostime import Duration, Time, clock, in_seconds
from rospy.session import session

_star_names(__name__, "genpy rospy threading time")


def sleep(duration: float | msg_time.Duration) -> None:
    """Sleep for `duration` on the node's clock. Numbers are in seconds. Return immediately if negative.

    As in Noetic, if the node uses wall time, its shutdown ends the sleep without an exception.

    Raises:
        ROSInterruptException: the node was shut down while using simulated time.
        ROSTimeMovedBackwardsException: simulated time moved backwards.
    """
    seconds = in_seconds(duration)
    if seconds < 0:
        return
    try:
        goes_on = session.clock.sleep(seconds)
    except TimeMovedBackwards as error:
        raise ROSTimeMovedBackwardsException(error.jump_s) from None
    _raise_if_interrupted(goes_on)


class Rate:
    """Rate in hertz at which to run a loop; see `pipros.node.rate.Rate`."""

    def __init__(self, hz: float, reset: bool = False) -> None:
        """Start the first cycle.

        If `reset` is true, restart instead of raising when simulated time moves backwards.

        Raises:
            ROSInitException: init_node has not been called.
            ZeroDivisionError: `hz` is 0.
        """
        self._rate = rate.Rate(clock(), int(NS_PER_S / hz), reset=reset)
        self._reset = reset

    @property
    def sleep_dur(self) -> Duration:
        """The length of a cycle."""
        return Duration(0, self._rate.period_ns)

    @property
    def last_time(self) -> Time:
        """The start of the current cycle."""
        return Time(*divmod(self._rate.last_ns, NS_PER_S))

    @last_time.setter
    def last_time(self, value: msg_time.Time) -> None:
        self._rate.last_ns = value.to_nsec()

    def remaining(self) -> Duration:
        """Return the time left in the current cycle, which is negative if the cycle is over."""
        return Duration(0, self._rate.remaining_ns())

    def _remaining(self, curr_time: msg_time.Time) -> Duration:
        """Return the time that is left at `curr_time`. If that is before the cycle, the cycle starts then."""
        return Duration(0, self._rate.remaining_ns(curr_time.to_nsec()))

    def sleep(self) -> None:
        """Sleep for the rest of the current cycle. Raises the same errors as `rospy.sleep`."""
        try:
            goes_on = self._rate.sleep()
        except TimeMovedBackwards as error:
            raise ROSTimeMovedBackwardsException(error.jump_s) from None
        _raise_if_interrupted(goes_on)


class TimerEvent:
    """Argument of a Timer's callback: expected and real times of the previous and the current call.

    `last_duration` is the duration of the previous call in seconds. The `last_…` attributes are None in the
    first call.
    """

    def __init__(
        self,
        last_expected: Time | None,
        last_real: Time | None,
        current_expected: Time,
        current_real: Time,
        last_duration: float | None,
    ) -> None:
        self.last_expected = last_expected
        self.last_real = last_real
        self.current_expected = current_expected
        self.current_real = current_real
        self.last_duration = last_duration


class Timer(rate.Timer):
    """Daemon thread that calls `callback(TimerEvent)` every `period` until `shutdown`. Starts immediately."""

    def __init__(
        self,
        period: msg_time.Duration,
        callback: Callable[[TimerEvent], object],
        oneshot: bool = False,
        reset: bool = False,  # noqa: ARG002
    ) -> None:
        """Start the thread. The thread ends if the callback raises an exception.

        Args:
            period: interval between calls, on the node's clock. A callback that takes longer than the period
                delays the next call.
            callback: called with a TimerEvent, one call at a time.
            oneshot: whether to end after one call.
            reset: has no effect since ROS 1.17: a timer always restarts if simulated time moves backwards.
        """

        def on_tick(tick: rate.Tick) -> None:
            callback(
                TimerEvent(
                    _time(tick.last_expected_ns),
                    _time(tick.last_real_ns),
                    Time(*divmod(tick.current_expected_ns, NS_PER_S)),
                    Time(*divmod(tick.current_real_ns, NS_PER_S)),
                    tick.last_duration_s,
                )
            )

        self._period = period
        super().__init__(session.clock, 0, on_tick, oneshot=oneshot, reset=True)

    def run(self) -> None:
        """Run the timer.

        Called by the thread itself. As in Noetic, an exception ends it if the period is not a Duration, or if
        `init_node` has not been called.
        """
        self._period.to_sec()
        self._clock, self._period_ns = clock(), self._period.to_nsec()
        super().run()


def _time(nanoseconds: int | None) -> Time | None:
    return None if nanoseconds is None else Time(*divmod(nanoseconds, NS_PER_S))


def _raise_if_interrupted(goes_on: bool) -> None:
    if not goes_on and session.node is not None and session.node.clock.is_simulated:
        raise ROSInterruptException("ROS shutdown request")
