"""`--outcomes-to` and `--but-passed`: outcomes of tests, and tests that a step of CI skips."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY
from tests.support.outcomes import Outcome, read_outcomes, times

TESTS = """
import pytest

@pytest.fixture
def broken_at_the_end():
    yield
    raise OSError

@pytest.mark.parametrize("number", [1, 2])
def test_passes(number): pass

def test_fails(): assert False

def test_is_skipped(): pytest.skip("not here")

def test_cannot_end(broken_at_the_end): pass
"""
STARTING_TESTS = """
import socket, subprocess, sys, threading, pytest

@pytest.fixture(scope="module")
def listener():
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        yield server

def test_thread():
    thread = threading.Thread(target=int)
    thread.start()
    thread.join()

def test_process(): subprocess.run([sys.executable, "-c", ""], check=True)

def test_first_user(listener): pass

def test_second_user(listener): pass

def test_pure(): pass
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "conftest.py").write_text(
        "from tests.support.project_conftest import pytest_addoption, pytest_collection_modifyitems\n"
        "from tests.support.outcomes import configure as pytest_configure\n"
    )
    (tmp_path / "test_it.py").write_text(TESTS)
    return tmp_path


@pytest.mark.parametrize("workers", [(), ("-n", "2")], ids=["one process", "two workers"])
def test_passed_tests_are_not_run_again(folder: Path, workers: tuple[str, ...]) -> None:
    before = _run(folder, "--outcomes-to=outcomes", *workers)
    after = _run(folder, "--but-passed=outcomes", *workers)

    assert "1 failed, 3 passed, 1 skipped, 1 error" in before
    results = {
        outcome.test.partition("::")[2]: outcome.result for outcome in read_outcomes(folder / "outcomes")
    }
    assert results == {
        "test_passes[1]": "passed",
        "test_passes[2]": "passed",
        "test_fails": "failed",
        "test_is_skipped": "skipped",
        "test_cannot_end": "failed",
    }
    assert "1 failed, 1 passed, 1 skipped" in after


def test_a_second_run_adds_to_the_file_with_the_output_of_failures(folder: Path) -> None:
    _run(folder, "--outcomes-to=outcomes", "-k", "passes and 1")
    _run(folder, "--outcomes-to=outcomes", "-k", "fails")

    passed, failed = read_outcomes(folder / "outcomes")
    assert (passed.result, passed.output) == ("passed", "")
    assert failed.result == "failed"
    assert "assert False" in failed.output


def test_an_outcome_lists_the_processes_of_the_test_and_its_fixtures(folder: Path) -> None:
    (folder / "test_it.py").write_text(STARTING_TESTS)

    _run(folder, "--outcomes-to=outcomes", "-n", "1")

    starts = {
        outcome.test.partition("::")[2]: outcome.starts for outcome in read_outcomes(folder / "outcomes")
    }
    assert starts == {
        "test_thread": ("thread",),
        "test_process": ("process",),
        "test_first_user": ("socket",),
        "test_second_user": ("socket",),
        "test_pure": (),
    }


def test_a_truncated_line_is_ignored(tmp_path: Path) -> None:
    outcome = Outcome("test_it.py::test_passes", "passed", 1.0)
    (tmp_path / "outcomes").write_text(json.dumps(asdict(outcome)) + '\n{"test": "half')

    assert read_outcomes(tmp_path / "outcomes") == [outcome]


def _run(folder: Path, *words: str) -> str:
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *words],
        cwd=folder,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    return ended.stdout


def test_an_outcome_has_the_processor_time_of_the_test_and_its_processes(folder: Path) -> None:
    busy = "import time\nwhile time.process_time() < 0.3: pass"
    (folder / "test_it.py").write_text(
        "import subprocess, sys, time\n"
        f"def test_here():\n    until = time.process_time() + 0.3\n"
        "    while time.process_time() < until: pass\n"
        f"def test_there(): subprocess.run([sys.executable, '-c', {busy!r}], check=True)\n"
        "def test_waits(): time.sleep(1)\n"
    )

    _run(folder, "--outcomes-to=outcomes", "-n", "1")

    spent = {
        outcome.test.partition("::")[2]: outcome.processor_s for outcome in read_outcomes(folder / "outcomes")
    }
    assert min(spent["test_here"], spent["test_there"]) > 0.25 > spent["test_waits"]


def test_the_dearest_folders_and_tests_come_first() -> None:
    printed = times(
        [
            Outcome("packages/pipros-tools/tests/unit/bag/test_a.py::test_x", "passed", 9.0, 2.0),
            Outcome("packages/pipros-tools/tests/unit/bag/test_b.py::test_y", "passed", 1.0, 3.0),
            Outcome("packages/pipros/tests/e2e/test_c.py::test_z", "passed", 1.0, 4.0),
        ],
        count=2,
    )
    assert [line.split() for line in printed.splitlines()] == [
        ["5.0", "s", "packages/pipros-tools/tests/unit/bag"],
        ["4.0", "s", "packages/pipros/tests/e2e/test_c.py"],
        [],
        ["4.0", "s", "packages/pipros/tests/e2e/test_c.py::test_z"],
        ["3.0", "s", "packages/pipros-tools/tests/unit/bag/test_b.py::test_y"],
        [],
        ["9.0", "s", "3", "tests"],
    ]
