"""The examples in docstrings are true."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

from tests.support.environments import REPOSITORY

SRC = REPOSITORY / "src"


def has_example(file: Path) -> bool:
    """True for a file with an example that needs no master to be running."""
    lines = file.read_text(encoding="utf-8").splitlines()
    return any(">>> " in line and "doctest: +SKIP" not in line for line in lines)


@pytest.mark.parametrize(
    "file", sorted(filter(has_example, SRC.rglob("*.py"))), ids=lambda file: str(file.relative_to(SRC))
)
def test_examples_in_docstrings_are_true(file: Path) -> None:
    module = importlib.import_module(".".join(file.relative_to(SRC).with_suffix("").parts))
    runner = doctest.DocTestRunner(verbose=False)
    report: list[str] = []
    for example in doctest.DocTestFinder(exclude_empty=True).find(module):
        runner.run(example, out=report.append)
    assert runner.tries
    assert report == []
