"""Wall clock and simulated clock: sleeps end at the right time."""

import threading

import pytest

from pipros.basics.errors import Interrupted
from pipros.node.clock import SimulatedClock, TimeMovedBackwards, WallClock
from pipros.node.rate import Rate, Tick, Timer
from tests.support.waiting import wait_until

S = 1_000_000_000


class Sleeper(threading.Thread):
    """Sleep on a clock in a thread, and keep the result."""

    def __init__(self, clock: SimulatedClock | WallClock, seconds: float) -> None:
        super().__init__(daemon=True)
        self.clock, self.seconds = clock, seconds
        self.result: bool | Exception | None = None
        self.start()

    def run(self) -> None:
        try:
            self.result = self.clock.sleep(self.seconds)
        except TimeMovedBackwards as error:
            self.result = error


def test_a_wall_clock_sleep_ends_with_the_node() -> None:
    clock = WallClock()
    sleeper = Sleeper(clock, 60)
    clock.interrupt()
    sleeper.join(30)
    assert sleeper.result is False


def test_the_exempt_thread_still_sleeps_while_the_node_ends() -> None:
    clock = WallClock()
    clock.interrupt(exempt=threading.get_ident())
    assert clock.sleep(0.001) is True


def test_simulated_time_is_zero_until_it_is_published() -> None:
    assert SimulatedClock().now_ns() == 0


def test_a_simulated_sleep_waits_for_the_first_clock_and_the_end() -> None:
    clock = SimulatedClock()
    sleeper = Sleeper(clock, 2)
    clock.set_ns(10 * S)
    wait_until(lambda: clock.sleeper_count)
    clock.set_ns(11 * S)
    assert sleeper.is_alive()
    clock.set_ns(13 * S)
    sleeper.join(30)
    assert sleeper.result is True


def test_a_simulated_sleep_ends_with_the_node() -> None:
    clock = SimulatedClock()
    sleeper = Sleeper(clock, 2)
    clock.interrupt()
    sleeper.join(30)
    assert sleeper.result is False


def test_a_sleep_raises_when_time_jumps_back() -> None:
    clock = SimulatedClock()
    clock.set_ns(10 * S)
    sleeper = Sleeper(clock, 2)
    wait_until(lambda: clock.sleeper_count)
    clock.set_ns(4 * S)
    sleeper.join(30)
    assert isinstance(sleeper.result, TimeMovedBackwards)
    assert sleeper.result.jump_s == -6


def test_a_sleep_without_a_clock_is_reported_once() -> None:
    told = threading.Event()
    clock = SimulatedClock(told.set, 0.01)
    sleeper = Sleeper(clock, 1)
    assert told.wait(30)
    assert sleeper.is_alive()
    clock.set_ns(S)
    wait_until(lambda: clock.sleeper_count)
    clock.set_ns(3 * S)
    sleeper.join(30)
    assert sleeper.result is True


# Rate


PERIOD_NS = 100


NANO = 1e-9


class FakeClock:
    """A clock that moves only during sleeps.

    Attributes:
        slept: requested duration of each sleep, in nanoseconds.
        is_over: the node has shut down.
        jump_ns: the next sleep ends with a jump of that size.
    """

    is_simulated = False

    def __init__(self) -> None:
        self.time_ns = 1000
        self.slept: list[int] = []
        self.is_over = False
        self.jump_ns = 0

    def now_ns(self) -> int:
        return self.time_ns

    def sleep(self, duration_s: float) -> bool:
        self.slept.append(round(duration_s / NANO))
        if self.jump_ns:
            self.time_ns += self.jump_ns
            self.jump_ns = 0
            raise TimeMovedBackwards(self.jump_ns * NANO)
        self.time_ns += max(round(duration_s / NANO), 0)
        return not self.is_over

    def interrupt(self, exempt: int | None = None) -> None:
        raise NotImplementedError


def test_a_cycle_is_as_long_as_the_period_whatever_the_work_takes() -> None:
    clock = FakeClock()
    rate = Rate(clock, PERIOD_NS)
    for work_ns in (0, 30, 99):
        clock.time_ns += work_ns
        assert rate.sleep()
    assert (clock.slept, clock.time_ns) == ([100, 70, 1], 1300)


def test_a_loop_that_is_a_little_late_catches_up_and_one_that_is_very_late_starts_again() -> None:
    clock = FakeClock()
    rate = Rate(clock, PERIOD_NS)
    clock.time_ns += 150
    rate.sleep()
    assert rate.remaining_ns() == 50
    clock.time_ns += 1000
    rate.sleep()
    assert rate.remaining_ns() == PERIOD_NS


def test_the_remaining_time_is_negative_when_the_cycle_is_over_and_whole_after_a_jump_back() -> None:
    clock = FakeClock()
    rate = Rate(clock, PERIOD_NS)
    clock.time_ns += 130
    assert rate.remaining_ns() == -30
    clock.time_ns = 10
    assert rate.remaining_ns() == PERIOD_NS


def test_a_jump_back_during_a_sleep_raises_without_reset() -> None:
    clock = FakeClock()
    clock.jump_ns = -500
    with pytest.raises(TimeMovedBackwards):
        Rate(clock, PERIOD_NS).sleep()
    clock.jump_ns = -400
    rate = Rate(clock, PERIOD_NS, reset=True)
    assert rate.sleep()
    assert rate.last_ns == clock.time_ns


def test_a_sleep_during_shutdown_returns_false() -> None:
    clock = FakeClock()
    clock.is_over = True
    assert not Rate(clock, PERIOD_NS).sleep()


def test_a_timer_event_has_the_expected_and_the_actual_time() -> None:
    clock = FakeClock()
    ticks: list[Tick] = []

    def work(tick: Tick) -> None:
        ticks.append(tick)
        clock.time_ns += 30
        clock.is_over = len(ticks) == 2

    Timer(clock, PERIOD_NS, work).join(30)

    assert [(tick.current_expected_ns, tick.current_real_ns) for tick in ticks] == [
        (1100, 1100),
        (1200, 1200),
    ]
    assert (ticks[0].last_expected_ns, ticks[0].last_real_ns, ticks[0].last_duration_s) == (None, None, None)
    assert (ticks[1].last_expected_ns, ticks[1].last_real_ns) == (1100, 1100)
    assert ticks[1].last_duration_s == pytest.approx(30 * NANO)


def test_a_timer_ends_after_one_call_or_when_it_is_shut_down() -> None:
    calls: list[Tick] = []
    Timer(FakeClock(), PERIOD_NS, calls.append, oneshot=True).join(30)
    assert len(calls) == 1

    made = threading.Event()
    timer: Timer

    def end(_: Tick) -> None:
        calls.append(_)
        made.wait(30)
        timer.shutdown()

    timer = Timer(FakeClock(), PERIOD_NS, end)
    made.set()
    timer.join(30)
    assert len(calls) == 2


def test_a_timer_whose_callback_waits_while_the_node_ends_leaves_no_traceback() -> None:
    def interrupted(_: Tick) -> None:
        raise Interrupted("the node was shut down while it waited")

    Timer(FakeClock(), PERIOD_NS, interrupted).join(30)  # pytest fails for an exception in a thread
