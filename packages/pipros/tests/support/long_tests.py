"""The tests that `script/long` runs, and others leave out.

Most are further cases of tests that CI runs: another address, browser window, starting value or release.
The file tests/long.txt lists them by node id, below packages/; `*` stands for any characters. pytest's option
`--long` runs these tests only.
"""

from __future__ import annotations

import re
from functools import cache

import pytest

from tests.support.environments import TESTS

LIST = TESTS / "long.txt"


def add_options(parser: pytest.Parser) -> None:
    """Add the option `--long`."""
    parser.addoption("--long", action="store_true", help="run only the tests in tests/long.txt")


def patterns() -> tuple[str, ...]:
    """Return the lines of tests/long.txt without comments."""
    lines = LIST.read_text(encoding="utf-8").splitlines()
    return tuple(line for line in lines if line and not line.startswith("#"))


@cache
def _pattern() -> re.Pattern[str]:
    return re.compile("|".join(f"(?:{re.escape(line)})".replace(r"\*", ".*") for line in patterns()))


def is_long(node_id: str) -> bool:
    """Return whether tests/long.txt lists a test."""
    return _pattern().fullmatch(node_id.removeprefix("packages/")) is not None


def leave_out(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect the listed tests, unless arguments name tests; with `--long`, deselect all others."""
    wanted = bool(config.getoption("--long"))
    if not wanted and any("::" in argument for argument in config.args):
        return
    left_out = [item for item in items if is_long(item.nodeid) is not wanted]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if is_long(item.nodeid) is wanted]
