"""`catkin.test_results`: reads and summarizes test result files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree.ElementTree import ParseError

from catkin.tidy_xml import tidy_xml as tidy_xml
from pipros.basics.lazy_names import star_names as _star_names
from pipros.safe.xml import XmlError, parse
from pipros.testing.result_counts import ResultCounts, count_results, results_below

_star_names(__name__, "xml.etree.ElementTree:ElementTree errno os")

Three = tuple[int, int, int]
Four = tuple[int, int, int, int]


def read_junit(filename: str) -> Three:
    """Return `(tests, errors, failures)` of a result file. Raises the same errors as `read_junit2`."""
    return read_junit2(filename)[:3]


def read_junit2(filename: str) -> Four:
    """Return `(tests, errors, failures, skipped)` of a result file.

    Raises:
        ValueError: the file is not a result file.
        xml.etree.ElementTree.ParseError: the file is not XML.
        OSError: the file cannot be read.
    """
    try:
        return _four(count_results(parse(Path(filename).read_bytes(), filename)))
    except XmlError as error:
        raise ParseError(str(error)) from None


def test_results(
    test_results_dir: str, show_verbose: bool = False, show_all: bool = False
) -> dict[str, Three]:
    """Return the result files below a folder, each with `(tests, errors, failures)`; see `test_results2`."""
    found = test_results2(test_results_dir, show_verbose, show_all)
    return {file: counts[:3] for file, counts in found.items()}


def test_results2(
    test_results_dir: str, show_verbose: bool = False, show_all: bool = False
) -> dict[str, Four]:
    """Return the result files below a folder, each with `(tests, errors, failures, skipped)`.

    Args:
        show_verbose: whether to print the contents of files with errors or failures.
        show_all: whether to print which files are not result files, and why.
    """
    folder = Path(test_results_dir).absolute()
    found: dict[str, Four] = {}
    for file, counts in results_below(folder):
        name = str(file.relative_to(folder))
        if isinstance(counts, str):
            if show_all:
                print(f'Skipping "{name}": {counts}')
            continue
        found[name] = _four(counts)
        if show_verbose and (counts.errors or counts.failures):
            print(f"Full test results for '{name}'\n{'-' * 49}\n{file.read_text('utf-8')}\n{'-' * 49}")
    return found


def _four(counts: ResultCounts) -> Four:
    return counts.tests, counts.errors, counts.failures, counts.skipped


def aggregate_results(
    results: Mapping[str, Four], callback_per_result: Callable[..., object] | None = None
) -> Three:
    """Like `aggregate_results2`, but without the number of skipped tests."""
    return aggregate_results2(results, callback_per_result)[:3]


def aggregate_results2(
    results: Mapping[str, Four], callback_per_result: Callable[..., object] | None = None
) -> Four:
    """Return the sums of all counts. Call the callback with each file's name and counts, in name order."""
    total = ResultCounts()
    for name in sorted(results):
        counts = ResultCounts(*_checked(results[name]))
        total += counts
        if callback_per_result is not None:
            callback_per_result(name, *_four(counts))
    return _four(total)


def _checked(counts: Four) -> Four:
    tests, errors, failures, skipped = counts
    return tests, errors, failures, skipped


def print_summary(results: Mapping[str, Four], show_stable: bool = False, show_unstable: bool = True) -> None:
    """Like `print_summary2`, but without the number of skipped tests."""
    print_summary2(results, show_stable, show_unstable, print_skipped=False)


def print_summary2(
    results: Mapping[str, Four],
    show_stable: bool = False,
    show_unstable: bool = True,
    print_skipped: bool = True,
) -> None:
    """Print the counts of each file and their sums.

    Args:
        show_stable: whether to print files in which all tests passed.
        show_unstable: whether to print the other files.
        print_skipped: whether to print the number of skipped tests.
    """

    def text(counts: ResultCounts) -> str:
        return str(counts) if print_skipped else str(counts).rpartition(",")[0]

    def show(name: str, *four: int) -> None:
        counts = ResultCounts(*four)
        if counts.has_trouble and show_unstable:
            print(f"{name}: {text(counts)}")
        elif not counts.has_trouble and show_stable:
            print(f"{name}: {counts.tests} tests")

    print(f"Summary: {text(ResultCounts(*aggregate_results2(results, show)))}")


def remove_junit_result(filename: str) -> None:
    """Remove a result file, and the substitute written by `ensure_junit_result_exist`, if they exist."""
    for file in (Path(filename), _missing(filename)):
        file.unlink(missing_ok=True)


def ensure_junit_result_exist(filename: str) -> bool:
    """Tidy an invalid result file, or write a failing result `MISSING-NAME` in place of a missing one.

    Return True only if the file was invalid.
    """
    if Path(filename).is_file():
        try:
            read_junit2(filename)
        except (ParseError, ValueError):
            print(f"Invalid XML in result file '{filename}'", file=sys.stderr)
            tidy_xml(filename)
        else:
            return False
        return True
    missing = _missing(filename)
    print(f"Cannot find results, writing failure results to '{missing}'", file=sys.stderr)
    name = Path(filename).name
    missing.parent.mkdir(parents=True, exist_ok=True)
    missing.write_text(
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<testsuite tests="1" failures="1" time="1" errors="0" name="Results">\n'
        f'  <testcase name="{name}" status="run" time="1" classname="Results">\n'
        f'    <failure message="The test did not generate results in {name}" type=""/>\n'
        "  </testcase>\n</testsuite>\n",
        encoding="utf-8",
    )
    return False


def _missing(filename: str) -> Path:
    return Path(filename).with_name(f"MISSING-{Path(filename).name}")
