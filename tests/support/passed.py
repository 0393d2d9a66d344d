"""Tests that passed in one step of continuous integration, so that another step does not run them again.

`--passed-to=FILE` adds the ids of those that passed to a file, and `--but-passed=FILE` leaves them out.
Both need the `=`: pytest takes a file that stands alone for a place of tests, and does not find them then.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

_PHASES = 3  # setup, call, teardown


def add_options(parser: pytest.Parser) -> None:
    """The two options."""
    parser.addoption("--passed-to", metavar="FILE", type=Path, help="add the ids of tests that passed")
    parser.addoption("--but-passed", metavar="FILE", type=Path, help="leave out the tests that it names")


class Recorder:
    """Adds the tests that passed in all their phases to a file."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._passed: Counter[str] = Counter()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._passed[report.nodeid] += report.passed

    def pytest_sessionfinish(self) -> None:
        with self._file.open("a", encoding="utf-8") as file:
            file.writelines(f"{test}\n" for test, phases in self._passed.items() if phases == _PHASES)


def configure(config: pytest.Config) -> None:
    """Starts to record if the command line asks for it: in the process that all workers report to."""
    file = config.getoption("--passed-to")
    if file is not None and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Recorder(file))


def leave_out(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Takes the tests that passed before out of `items`."""
    file = config.getoption("--but-passed")
    if file is None:
        return
    passed = set(file.read_text(encoding="utf-8").splitlines())
    left = [item for item in items if item.nodeid not in passed]
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid in passed])
    items[:] = left
