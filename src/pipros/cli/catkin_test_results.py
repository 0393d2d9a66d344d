"""`catkin_test_results`: sums up the result files of tests."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from pipros.safe.xml import XmlError, parse


def main(argv: Sequence[str] | None = None) -> int:
    """Prints the files with failures and the sums; returns 1 when there are failures."""
    parser = ArgumentParser(
        prog="catkin_test_results",
        description="Outputs a summary of the test results. If there are any test errors or failures the "
        "script exits with code 1.",
    )
    parser.add_argument(
        "test_results_dir", nargs="?", default="build/test_results", help="The path to the test results"
    )
    parser.add_argument("--verbose", action="store_true", help="Show all tests which have errors or failed")
    parser.add_argument("--all", action="store_true", help="Show all test results, not only the failed ones")
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    folder = Path(options.test_results_dir)
    if not folder.is_dir():
        print(f"Test results directory '{folder}' does not exist", file=sys.stderr)
        return 1
    sums = [0, 0, 0]
    for file in sorted(folder.rglob("*.xml")):
        try:
            root = parse(file.read_bytes(), str(file))
        except XmlError as error:
            print(f"Skipping '{error}'", file=sys.stderr)
            continue
        counts = [0, 0, 0]
        for suite in [root] if root.tag == "testsuite" else list(root.all("testsuite")):
            for index, name in enumerate(("tests", "errors", "failures")):
                number = suite.attributes.get(name, "0")
                counts[index] += int(number) if number.isdecimal() else 0
        sums = [total + count for total, count in zip(sums, counts, strict=True)]
        if options.all or counts[1] or counts[2]:
            print(f"{file.relative_to(folder)}: {_counted(counts)}")
    print(f"Summary: {_counted(sums)}")
    return 1 if sums[1] or sums[2] else 0


def _counted(counts: Sequence[int]) -> str:
    return f"{counts[0]} tests, {counts[1]} errors, {counts[2]} failures, 0 skipped"


if __name__ == "__main__":
    sys.exit(main())
