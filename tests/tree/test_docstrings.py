"""The examples in docstrings print what they show."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

from tests.support.environments import import_path, source_files


def has_example(file: Path) -> bool:
    """Return True for a file with an example that needs no master to be running."""
    lines = file.read_text(encoding="utf-8").splitlines()
    return any(">>> " in line and "doctest: +SKIP" not in line for line in lines)


@pytest.mark.parametrize(
    "file", list(filter(has_example, source_files())), ids=lambda file: str(import_path(file))
)
def test_examples_in_docstrings_are_true(file: Path) -> None:
    module = importlib.import_module(".".join(import_path(file).with_suffix("").parts))
    runner = doctest.DocTestRunner(verbose=False)
    report: list[str] = []
    for example in doctest.DocTestFinder(exclude_empty=True).find(module):
        runner.run(example, out=report.append)
    assert runner.tries
    assert report == []
