"""Run a function in several processes, which Ctrl-C ends without tracebacks."""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from typing import Any, TypeVar

_Work = TypeVar("_Work")
_Result = TypeVar("_Result")
_PERIOD_S = 0.2

SPAWN = multiprocessing.get_context("spawn")


def in_processes(
    function: Callable[[_Work], _Result],
    works: Sequence[_Work],
    jobs: int,
    *,
    prepare: Callable[..., object] | None = None,
    arguments: tuple[Any, ...] = (),
    idle: Callable[[], object] | None = None,
) -> Iterator[_Result]:
    """Yield the result of each work as it is ready. With one job, everything runs in this process.

    After an error of one, or Ctrl-C, the processes are terminated.

    Args:
        prepare: called with `arguments` at the start of each process.
        idle: called five times a second while results are awaited.
    """
    if jobs == 1:
        if prepare is not None:
            prepare(*arguments)
        yield from map(function, works)
        return
    pool = ProcessPoolExecutor(jobs, SPAWN, _begin, (prepare, arguments))
    try:
        left = set(_submitted(pool, function, works))
        while left:
            done, left = wait(left, _PERIOD_S if idle else None, FIRST_COMPLETED)
            if idle is not None:
                idle()
            for each in done:
                yield each.result()
        pool.shutdown()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()
        raise


def _begin(prepare: Callable[..., object] | None, arguments: tuple[Any, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if prepare is not None:
        prepare(*arguments)


def _submitted(
    pool: ProcessPoolExecutor, function: Callable[[_Work], _Result], works: Sequence[_Work]
) -> list[Future[_Result]]:
    """Submit the work with SIGINT blocked.

    The new processes inherit the signal mask, so that Ctrl-C during their start causes no tracebacks.
    """
    if sys.platform == "win32":  # Windows has no signal masks
        return [pool.submit(function, work) for work in works]
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return [pool.submit(function, work) for work in works]
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
