"""`--passed-to` and `--but-passed`: a step of continuous integration leaves out what passed in one before."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
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


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "conftest.py").write_text(
        "from tests.conftest import pytest_addoption, pytest_collection_modifyitems\n"
        "from tests.support.passed import configure as pytest_configure\n"
    )
    (tmp_path / "test_it.py").write_text(TESTS)
    return tmp_path


@pytest.mark.parametrize("workers", [(), ("-n", "2")], ids=["one process", "two workers"])
def test_what_passed_is_not_run_again(folder: Path, workers: tuple[str, ...]) -> None:
    before = _run(folder, "--passed-to=passed", *workers)
    after = _run(folder, "--but-passed=passed", *workers)

    assert "1 failed, 3 passed, 1 skipped, 1 error" in before
    assert sorted((folder / "passed").read_text().splitlines()) == [
        "test_it.py::test_passes[1]",
        "test_it.py::test_passes[2]",
    ]
    assert "1 failed, 1 passed, 1 skipped" in after


def test_a_second_run_adds_to_the_file(folder: Path) -> None:
    _run(folder, "--passed-to=passed", "-k", "passes and 1")
    _run(folder, "--passed-to=passed", "-k", "passes and 2")

    assert len((folder / "passed").read_text().splitlines()) == 2


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
