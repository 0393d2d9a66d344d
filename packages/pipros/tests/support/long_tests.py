"""The tests that `script/long` runs, and others leave out.

Most are further cases of tests that CI runs: another address, browser window, starting value or release.
The file tests/long.txt lists them by node id, below packages or plugins; `*` stands for any characters. A
number before a test lists its other cases, except for the first and each so-many-th after it. The option
`--long` runs the listed tests only.
"""

import re
from collections import Counter
from collections.abc import Iterable
from functools import cache

import pytest

from tests.support.environments import file_of_tests

LIST = file_of_tests("long.txt")


def add_options(parser: pytest.Parser) -> None:
    """Add the option `--long`."""
    parser.addoption("--long", action="store_true", help="run only the tests in tests/long.txt")


def patterns() -> tuple[str, ...]:
    """Return the lines of tests/long.txt without comments."""
    lines = LIST.read_text(encoding="utf-8").splitlines()
    return tuple(line for line in lines if line and not line.startswith("#"))


@cache
def _pattern() -> re.Pattern[str]:
    whole = (line for line in patterns() if not line[0].isdigit())
    return re.compile("|".join(f"(?:{re.escape(line)})".replace(r"\*", ".*") for line in whole))


@cache
def _strides() -> dict[str, int]:
    numbered = (line.split(" ", 1) for line in patterns() if line[0].isdigit())
    return {test: int(number) for number, test in numbered}


def find_long(node_ids: Iterable[str]) -> set[str]:
    """Return those of all tests that tests/long.txt lists."""
    found = set()
    cases: Counter[str] = Counter()
    for node_id in node_ids:
        name = node_id.partition("/")[2]
        test = name.partition("[")[0]
        if _pattern().fullmatch(name):
            found.add(node_id)
            continue
        if cases[test] % _strides().get(test, 1):
            found.add(node_id)
        cases[test] += 1
    return found


def leave_out(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect the listed tests, unless arguments name tests; with `--long`, deselect all others."""
    wanted = bool(config.getoption("--long"))
    if not wanted and any("::" in argument for argument in config.args):
        return
    listed = find_long(item.nodeid for item in items)
    left_out = [item for item in items if (item.nodeid in listed) is not wanted]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if (item.nodeid in listed) is wanted]
