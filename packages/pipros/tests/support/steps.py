"""Count the lines of Python that a function executes, to compare costs without measuring time."""

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any


def steps_of(function: Callable[[], object]) -> int:
    """Return the number of lines executed, where each turn of a loop or comprehension counts."""
    count = 0

    def trace(_frame: FrameType, event: str, _value: Any) -> Any:
        nonlocal count
        count += event == "line"
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        function()
    finally:
        sys.settrace(before)
    return count


def grows_linearly(make: Callable[[int], Callable[[], object]]) -> bool:
    """Return whether the function for size 400 executes at most about six times the lines of size 100.

    Args:
        make: prepares the function for a size. This preparation is not counted.
    """
    return steps_of(make(400)) < 6.5 * steps_of(make(100))
