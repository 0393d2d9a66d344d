"""An event loop with a simulated clock: timers run immediately, in the order of their times."""

import asyncio
import selectors
from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Any, TypeVar

_Result = TypeVar("_Result")


class _InstantSelector(selectors.SelectSelector):
    """A selector that never blocks, and adds up the timeouts that it skips."""

    def __init__(self) -> None:
        super().__init__()
        self.waited_s = 0.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None:
            raise RuntimeError("the loop would wait forever: no timer and no task is left to run")
        self.waited_s += max(timeout, 0)
        return super().select(0)


class InstantLoop(asyncio.SelectorEventLoop):
    """An event loop whose `time()` starts at 0 and advances by the skipped timeouts."""

    def __init__(self) -> None:
        self._instant = _InstantSelector()
        super().__init__(self._instant)

    def time(self) -> float:
        return self._instant.waited_s


def run_instantly(main: Coroutine[Any, Any, _Result]) -> _Result:
    """Run a coroutine like `asyncio.run`, on an `InstantLoop`."""
    loop = InstantLoop()
    try:
        return loop.run_until_complete(main)
    finally:
        loop.close()


def instantly(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    """Decorator that makes a test of a coroutine function, which runs on an `InstantLoop`."""

    @wraps(test)
    def run(**fixtures: Any) -> None:
        run_instantly(test(**fixtures))

    return run
