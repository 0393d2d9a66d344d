"""`script/hunt`: failure rates, resumption, and the verdict on tests that failed once in CI."""

from __future__ import annotations

import json
import os
from contextlib import nullcontext
from dataclasses import asdict
from datetime import date
from pathlib import Path

import psutil
import pytest

from tests.support import hunt
from tests.support.environments import REPOSITORY
from tests.support.hunt import Quarantined, failure_table, judge, read_quarantine
from tests.support.outcomes import Outcome, read_outcomes

TESTS = """
from pathlib import Path
COUNT = Path(__file__).with_name("count")

def test_failed_once(): pass

def test_fails_now_and_then():
    runs = int(COUNT.read_text()) if COUNT.exists() else 0
    COUNT.write_text(str(runs + 1))
    assert runs not in {failing}
"""


@pytest.fixture
def flaky(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Create tests outside of the tree that have its options; return the start of their node ids."""
    (tmp_path / "conftest.py").write_text(
        "from tests.support.project_conftest import pytest_addoption, pytest_collection_modifyitems\n"
        "from tests.support.outcomes import configure as pytest_configure\n"
    )
    (tmp_path / "test_it.py").write_text(TESTS.replace("{failing}", "(0, 1, 2)"))
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    monkeypatch.setenv("PYTHONPATH", str(REPOSITORY))
    monkeypatch.setattr(hunt, "REPOSITORY", tmp_path)  # `judge` runs tests of this repository only
    monkeypatch.setattr(hunt, "busy_processors", nullcontext)  # they would slow down other tests
    return "test_it.py::"


def written(folder: Path, *outcomes: Outcome) -> Path:
    file = folder / "outcomes"
    file.write_text("".join(json.dumps(asdict(outcome)) + "\n" for outcome in outcomes))
    return file


def test_two_failed_repetitions_fail_the_run_and_passed_ones_do_not(flaky: str, tmp_path: Path) -> None:
    test = f"{flaky}test_fails_now_and_then"
    steady = Outcome(f"{flaky}test_failed_once", "failed", 1.0, output="what it said")
    file = written(tmp_path, steady, Outcome(test, "failed", 1.0))

    passes, report = judge(file, (), {}, times=3)
    (tmp_path / "count").unlink()
    quarantined, _ = judge(
        file, (), {test: Quarantined(test, "a race", "1 of 10", date(2026, 11, 21))}, times=3
    )

    assert not passes
    assert "passed 3 of 3 repetitions" in report
    assert "what it said" in report
    assert "passed 0 of 2 repetitions" in report
    assert "assert 0 not in (0, 1, 2)" in report
    assert quarantined


def test_a_failed_repetition_is_reported_and_does_not_fail_the_run(flaky: str, tmp_path: Path) -> None:
    (tmp_path / "count").write_text("2")

    passes, report = judge(
        written(tmp_path, Outcome(f"{flaky}test_fails_now_and_then", "failed", 1.0)), (), {}, times=4
    )

    assert passes
    assert "passed 3 of 4 repetitions" in report
    assert "assert 2 not in (0, 1, 2)" in report


def test_a_test_is_not_repeated_after_its_second_failed_repetition(flaky: str, tmp_path: Path) -> None:
    passes, report = judge(
        written(tmp_path, Outcome(f"{flaky}test_fails_now_and_then", "failed", 1.0)), (), {}, times=10
    )

    assert not passes
    assert "passed 0 of 2 repetitions" in report


def test_failures_in_many_files_are_not_repeated(tmp_path: Path) -> None:
    file = written(tmp_path, *(Outcome(f"test_{number}.py::test_it", "failed", 1.0) for number in range(11)))

    assert judge(file, (), {}) == (False, "tests of 11 files failed, more than the 10 that are repeated")


def test_a_hunt_continues_where_it_ended(flaky: str, tmp_path: Path) -> None:
    results = tmp_path / "results"

    first = hunt.hunt(results, times=20, other_times=1, words=["-p", "no:cacheprovider"])
    after_first = len(read_outcomes(results))
    second = hunt.hunt(results, times=20, other_times=2, words=["-p", "no:cacheprovider"])

    assert (first, second) == (0, 0)
    assert (after_first, len(read_outcomes(results))) == (2, 4)


def test_each_processor_has_a_busy_process() -> None:
    with hunt.busy_processors():
        busy = [each for each in psutil.Process().children() if "-c" in each.cmdline()]
        assert len(busy) == os.cpu_count()


def test_the_table_shows_the_most_frequent_failure_first() -> None:
    outcomes = [
        Outcome("steady", "passed", 0.1),
        Outcome("rare", "failed", 0.1),
        Outcome("rare", "passed", 0.1),
        Outcome("rare", "passed", 0.1),
        Outcome("often", "failed", 0.1),
    ]

    assert failure_table(outcomes).splitlines() == [
        "  1 of   1  often",
        "  1 of   3  rare",
        "2 of 3 tests failed at least once in 5 runs",
    ]


def test_the_quarantine_is_short_and_explains_each_entry() -> None:
    for test in read_quarantine():
        assert (REPOSITORY / test.partition("::")[0]).is_file()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[test]]\ntest = "t"\ncause = ""\nevidence = "e"\nsince = 2026-01-01\n', "needs a cause"),
        ('[[test]]\ntest = "t"\ncause = "c"\nevidence = "e"\nsince = "today"\n', "a date"),
        ('[[test]]\ntest = "t"\ncause = "c"\nevidence = "e"\nsince = 2026-01-01\n' * 6, "at most 5"),
        ('[[test]]\ntest = "t"\ncause = "c"\nevidence = "e"\nsince = 2025-12-17\n', "must be mended"),
    ],
)
def test_an_invalid_quarantine_is_refused(text: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "quarantine.toml"
    file.write_text(text)

    with pytest.raises(ValueError, match=message):
        read_quarantine(file, date(2026, 1, 1))
