"""`catkin_test_results`: summarizes test result files."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros_tools.cli.entry_point import command
from pipros_tools.testing.result_counts import ResultCounts, results_below

_RULE = "-" * 49


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the files with errors, failures or skipped tests, and the totals.

    Return 1 if there are errors or failures, otherwise 0.
    """
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
    results: dict[Path, ResultCounts] = {}
    for file, counts in results_below(folder):
        if isinstance(counts, ResultCounts):
            results[file] = counts
        elif options.all:
            print(f'Skipping "{file.relative_to(folder)}": {counts}')
    if options.verbose:
        for file, counts in results.items():
            if counts.errors or counts.failures:
                print(f"Full test results for '{file.relative_to(folder)}'\n{_RULE}")
                print(f"{read_file(file).decode('utf-8', 'replace')}\n{_RULE}")
    total = ResultCounts()
    for file, counts in results.items():
        total += counts
        if options.all or counts.has_trouble:
            text = str(counts) if counts.has_trouble else f"{counts.tests} tests"
            print(f"{file.relative_to(folder)}: {text}")
    print(f"Summary: {total}")
    return 1 if total.errors or total.failures else 0


if __name__ == "__main__":
    sys.exit(main())
