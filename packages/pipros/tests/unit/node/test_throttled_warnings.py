from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from pipros.node.throttled_warnings import FULL, ThrottledWarnings
from tests.support.nodes import listening_log


def test_the_first_complaints_are_logged_and_the_others_counted() -> None:
    log, lines = listening_log()
    later: list[Callable[[], Any]] = []
    loop: Any = SimpleNamespace(asyncio=SimpleNamespace(call_later=lambda _, report: later.append(report)))
    warnings = ThrottledWarnings(log, loop, "%d more; the last is %s")

    allowed = [warnings.should_log(str(number)) for number in range(100)]

    assert allowed == [True] * FULL + [False] * (100 - FULL)
    assert (len(later), lines) == (1, [])
    later.pop()()
    assert lines == [f"{100 - FULL} more; the last is 99"]
    assert warnings.should_log("another")
    later.pop()()
    assert len(lines) == 1
