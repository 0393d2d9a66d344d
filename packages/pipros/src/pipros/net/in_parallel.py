"""Call many peers at the same time. Ctrl-C ends the wait immediately."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from queue import SimpleQueue
from typing import TypeVar

from pipros.basics.interruptible_wait import get_within_slice
from pipros.net.workers import Workers

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")


def in_parallel(keys: Iterable[_Key], ask: Callable[[_Key], _Value], *, at_once: int) -> dict[_Key, _Value]:
    """Call `ask` with each key and return the results in the order of the keys.

    `ask` runs in at most `at_once` daemon threads, and must time out on its own. An exception raised by
    `ask`, or by a signal handler in the calling thread, ends the wait. Calls that have not started are
    dropped. Unlike with `ThreadPoolExecutor`, neither the caller nor the exiting interpreter waits for the
    other calls.
    """
    wanted = list(keys)
    outcomes: SimpleQueue[tuple[_Key, list[_Value], BaseException | None]] = SimpleQueue()
    is_waiting = True

    def answer(key: _Key) -> None:
        if not is_waiting:
            return
        try:
            outcomes.put((key, [ask(key)], None))
        except BaseException as error:  # the calling thread reraises it
            outcomes.put((key, [], error))

    workers = Workers("in parallel", at_once)
    values: dict[_Key, _Value] = {}
    try:
        for key in wanted:
            workers.run(answer, key)
        while len(values) < len(wanted):
            outcome = get_within_slice(outcomes)
            if outcome is None:
                continue
            key, value, error = outcome
            if error is not None:
                raise error
            values[key] = value[0]
    finally:
        is_waiting = False
        workers.close()
    return {key: values[key] for key in wanted}
