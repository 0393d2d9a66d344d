"""Wall clock and simulated clock: sleeps end at the right time."""

from __future__ import annotations

import threading

from pipros.node.clock import SimulatedClock, TimeMovedBackwards, WallClock
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
