"""`catkin_test_results`: sums up the result files of tests."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pipros.cli.streams import command
from pipros.input_file import read_file
from pipros.safe.xml import Element, XmlError, parse

_RULE = "-" * 49


@dataclass(frozen=True, slots=True)
class _Counts:
    """The counts of one result file."""

    tests: int = 0
    errors: int = 0
    failures: int = 0
    skipped: int = 0

    def __add__(self, other: _Counts) -> _Counts:
        return _Counts(
            self.tests + other.tests,
            self.errors + other.errors,
            self.failures + other.failures,
            self.skipped + other.skipped,
        )

    @property
    def has_trouble(self) -> bool:
        """Whether a test failed, had an error, or was skipped."""
        return bool(self.errors or self.failures or self.skipped)

    def __str__(self) -> str:
        return f"{self.tests} tests, {self.errors} errors, {self.failures} failures, {self.skipped} skipped"


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Prints the files with failures and the sums; returns 1 when there are failures."""
    parser = ArgumentParser(
        prog="catkin_test_results",
        description="Outputs a summary of the test results. If there are any test errors or failures the "
        "script exits with code 1.",
    )
    add = parser.add_argument
    add("test_results_dir", nargs="?", default=os.curdir, help="The path to the test results")
    add("--all", action="store_true", help="Show all result files, also those without errors and no results")
    add("--verbose", action="store_true", help="Show all tests which have errors or failed")
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    folder = Path(options.test_results_dir).absolute()
    if not folder.is_dir():
        print(f'Test results directory "{folder}" does not exist', file=sys.stderr)
        return 1
    results: dict[Path, _Counts] = {}
    for file, counts in _results(folder):
        if isinstance(counts, _Counts):
            results[file] = counts
        elif options.all:
            print(f'Skipping "{file.relative_to(folder)}": {counts}')
    if options.verbose:
        for file, counts in results.items():
            if counts.errors or counts.failures:
                print(f"Full test results for '{file.relative_to(folder)}'\n{_RULE}")
                print(f"{read_file(file).decode('utf-8', 'replace')}\n{_RULE}")
    total = _Counts()
    for file, counts in results.items():
        total += counts
        if options.all or counts.has_trouble:
            text = str(counts) if counts.has_trouble else f"{counts.tests} tests"
            print(f"{file.relative_to(folder)}: {text}")
    print(f"Summary: {total}")
    return 1 if total.errors or total.failures else 0


def _results(folder: Path) -> Iterator[tuple[Path, _Counts | str]]:
    """All XML files below a folder with their counts, or the reason why a file does not have results."""
    for file in sorted(folder.rglob("*.xml")):
        try:
            yield file, _count(parse(read_file(file), str(file)))
        except XmlError as error:
            yield file, error.reason
        except (KeyError, ValueError, OSError) as error:
            yield file, str(error)


def _count(root: Element) -> _Counts:
    """Raises KeyError or ValueError when it is not a result file."""
    if root.tag == "testsuite":
        return _counts_of(root)
    if root.tag != "testsuites":
        raise ValueError("the root tag is neither 'testsuite' nor 'testsuites'")
    total = _Counts()
    for element in (root, *root.all("testsuite")):
        with suppress(KeyError):  # an element without all counts is ignored, as in Noetic
            total += _counts_of(element)
    return total


def _counts_of(element: Element) -> _Counts:
    numbers = element.attributes
    skipped = sum(int(numbers.get(name, "0")) for name in ("skip", "skipped", "disabled"))
    return _Counts(int(numbers["tests"]), int(numbers["errors"]), int(numbers["failures"]), skipped)


if __name__ == "__main__":
    sys.exit(main())
