"""Check the output of programs."""

import re
from collections.abc import Sequence


def assert_in_order(output: str, patterns: Sequence[str]) -> None:
    """Raise AssertionError unless the patterns are found on separate lines, in this order."""
    lines = iter(output.splitlines())
    for number, pattern in enumerate(patterns):
        if not any(re.search(pattern, line) for line in lines):
            after = f" after /{patterns[number - 1]}/" if number else ""
            raise AssertionError(f"no line /{pattern}/{after} in:\n{output}")


def without_escapes(text: str) -> str:
    """Return the text without the escape sequences for colours and window titles."""
    return re.sub(r"\x1b\][^\x07]*\x07|\x1b\[[0-9;]*m", "", text)
