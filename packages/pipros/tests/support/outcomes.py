"""Store the outcomes of tests in a file, for `script/hunt` and for continuous integration.

`--outcomes-to=FILE` appends one line of JSON for each test. `--but-passed=FILE` deselects the tests that
passed according to such a file. Both options need the `=`, because pytest would take a separate argument for
a path of tests. `python -m tests.support.outcomes FILE…` prints where the processor time of such runs went.
"""

import json
import os
import sys
from collections import defaultdict
from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import pytest

from tests.support.answers import spent_s

_PROCESSOR_S = "processor_s"


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of one run of a test.

    Attributes:
        test: the node id of the test.
        result: `passed`, `failed` or `skipped`.
        processor_s: processor time of the test, its fixtures, and the processes that they waited for.
        output: what pytest prints about a failure.
    """

    test: str
    result: str
    seconds: float
    processor_s: float = 0.0
    output: str = ""


def read_outcomes(file: Path) -> list[Outcome]:
    """Return the outcomes in `file`, oldest first. An incomplete last line is ignored."""
    lines = file.read_text(encoding="utf-8").split("\n")[:-1] if file.exists() else []
    return [Outcome(**fields) for fields in map(json.loads, lines)]


def times(outcomes: Sequence[Outcome], count: int = 20) -> str:
    """Return the processor seconds of the dearest folders and tests, one line each, and of all tests."""
    by_folder: defaultdict[str, float] = defaultdict(float)
    for outcome in outcomes:
        by_folder["/".join(outcome.test.partition("::")[0].split("/")[:5])] += outcome.processor_s
    dearest = sorted(outcomes, key=lambda outcome: -outcome.processor_s)[:count]
    by_cost = sorted(by_folder.items(), key=lambda pair: -pair[1])[:count]
    lines = [f"{seconds:8.1f} s  {folder}" for folder, seconds in by_cost]
    lines += ["", *(f"{outcome.processor_s:8.1f} s  {outcome.test}" for outcome in dearest)]
    return "\n".join([*lines, "", f"{sum(by_folder.values()):8.1f} s  {len(outcomes)} tests"])


def add_options(parser: pytest.Parser) -> None:
    """Add the options `--outcomes-to` and `--but-passed`."""
    parser.addoption("--outcomes-to", metavar="FILE", type=Path, help="add the outcome of each test")
    parser.addoption("--but-passed", metavar="FILE", type=Path, help="leave out the tests that passed before")


class Recorder:
    """Appends each outcome to a file, in the process to which all workers report."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._reports: dict[str, list[pytest.TestReport]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        reports = self._reports.setdefault(report.nodeid, [])
        reports.append(report)
        # xdist reports "???" for a worker that crashed.
        if report.when in ("setup", "call"):
            return
        del self._reports[report.nodeid]
        known = dict(report.user_properties)
        outcome = Outcome(
            report.nodeid,
            next((phase.outcome for phase in reports if not phase.passed), "passed"),
            round(sum(phase.duration for phase in reports), 3),
            float(known.get(_PROCESSOR_S, 0.0)),  # type: ignore[arg-type]
            "\n".join(_text(phase) for phase in reports if phase.failed),
        )
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(outcome)) + "\n")


def _text(report: pytest.TestReport) -> str:
    sections = [f"--- {title}\n{content}" for title, content in report.sections]
    return "\n".join([f"{report.nodeid} ({report.when})", report.longreprtext, *sections])


class TimeRecorder:
    """Records the processor time of a test, also of the fixtures that it is the first or last to use."""

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self) -> Generator[None, object, object]:
        self._began_s = _processor_s()
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        if call.when == "teardown":
            report.user_properties.append((_PROCESSOR_S, round(_processor_s() - self._began_s, 2)))
        return report


def _processor_s() -> float:
    """Return the processor time of this process, of those that it has waited for, and of forks for it."""
    return sum(os.times()[:4]) + spent_s()


def configure(config: pytest.Config) -> None:
    """Start recording if `--outcomes-to` is given."""
    file = config.getoption("--outcomes-to")
    if file is None:
        return
    config.pluginmanager.register(TimeRecorder())
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Recorder(file))


def leave_out(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Remove the tests that passed according to `--but-passed` from `items`."""
    file = config.getoption("--but-passed")
    if file is None:
        return
    passed = {outcome.test for outcome in read_outcomes(file) if outcome.result == "passed"}
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid in passed])
    items[:] = [item for item in items if item.nodeid not in passed]


if __name__ == "__main__":
    print(times([outcome for file in sys.argv[1:] for outcome in read_outcomes(Path(file))]))
