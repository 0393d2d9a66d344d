"""Waiting for transforms, with a clock that the test sets."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from pipros_libraries.transforms.waiter import TransformWaiter

S = 1_000_000_000


class SetClock:
    """A simulated clock that returns the given times, one at each reading, and then the last of them."""

    is_simulated = True

    def __init__(self, *times: int) -> None:
        self._times = list(times)

    def now_ns(self) -> int:
        return self._times.pop(0) if len(self._times) > 1 else self._times[0]


Ask = Callable[[], tuple[int, str]]


def waited(clock: SetClock, ask: Ask, check: Callable[[], object]) -> tuple[int, str]:
    return TransformWaiter().wait(ask, 10 * S, lambda: clock, check)


@pytest.mark.parametrize("end", [110 * S, 96 * S])
def test_a_wait_ends_at_its_time_or_when_the_clock_has_jumped_back(end: int) -> None:
    checks: list[int] = []

    answer = waited(SetClock(100 * S, 98 * S, end), lambda: (0, "unknown"), lambda: checks.append(1))

    assert (answer, len(checks)) == ((0, "unknown"), 1)


def test_a_check_that_raises_ends_the_wait() -> None:
    def check() -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        waited(SetClock(100 * S), lambda: (0, "unknown"), check)
