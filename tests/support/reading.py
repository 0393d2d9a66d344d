"""Reading what programs print: lines in their order, with the parts that differ from run to run left open."""

from __future__ import annotations

import re
from collections.abc import Sequence


def assert_in_order(output: str, patterns: Sequence[str]) -> None:
    """Raises AssertionError unless each pattern is found on a line of its own, one after the other."""
    lines = iter(output.splitlines())
    for number, pattern in enumerate(patterns):
        if not any(re.search(pattern, line) for line in lines):
            after = f" after /{patterns[number - 1]}/" if number else ""
            raise AssertionError(f"no line /{pattern}/{after} in:\n{output}")


def without_escapes(text: str) -> str:
    """The text without colours and window titles."""
    return re.sub(r"\x1b\][^\x07]*\x07|\x1b\[[0-9;]*m", "", text)
