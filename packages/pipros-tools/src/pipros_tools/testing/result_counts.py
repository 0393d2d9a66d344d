"""Count the tests in result files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros.safe.xml import Element, XmlError, parse


@dataclass(frozen=True, slots=True)
class ResultCounts:
    """The counts in one result file."""

    tests: int = 0
    errors: int = 0
    failures: int = 0
    skipped: int = 0

    def __add__(self, other: ResultCounts) -> ResultCounts:
        return ResultCounts(
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


def results_below(folder: Path) -> Iterator[tuple[Path, ResultCounts | str]]:
    """Yield each XML file below a folder, with its counts or the reason why it cannot be read."""
    for file in sorted(folder.rglob("*.xml")):
        try:
            yield file, count_results(parse(read_file(file), str(file)))
        except XmlError as error:
            yield file, error.reason
        except (KeyError, ValueError, OSError) as error:
            yield file, str(error)


def count_results(root: Element) -> ResultCounts:
    """Return the counts in a result file. Raise KeyError or ValueError if the file is not a result file."""
    if root.tag == "testsuite":
        return _counts_of(root)
    if root.tag != "testsuites":
        raise ValueError("the root tag is neither 'testsuite' nor 'testsuites'")
    total = ResultCounts()
    for element in (root, *root.all("testsuite")):
        with suppress(KeyError):  # an element that lacks one of the counts is ignored, as in Noetic
            total += _counts_of(element)
    return total


def _counts_of(element: Element) -> ResultCounts:
    numbers = element.attributes
    skipped = sum(int(numbers.get(name, "0")) for name in ("skip", "skipped", "disabled"))
    return ResultCounts(int(numbers["tests"]), int(numbers["errors"]), int(numbers["failures"]), skipped)
