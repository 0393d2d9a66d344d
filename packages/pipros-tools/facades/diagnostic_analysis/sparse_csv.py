"""`rosrun diagnostic_analysis sparse_csv.py`: write a CSV file with fewer rows."""

from __future__ import annotations

import argparse
import sys

from diagnostic_analysis.sparse import make_sparse_length, make_sparse_skip

_LARGEST = 65000
"""Number of rows that all common spreadsheet programs support."""


def main() -> int:
    """Write the file. Return the exit code, which is 1 if a number is below 1 or reading or writing fails."""
    parser = argparse.ArgumentParser("sparse_csv.py", description="Writes a CSV file with fewer rows.")
    parser.add_argument("-l", "--length", type=int, metavar="LEN", help="approximate number of rows to keep")
    parser.add_argument(
        "-s", "--skip", type=int, default=10, metavar="SKIP", help="without a length: keep each SKIP-th row"
    )
    parser.add_argument("-m", "--max", action="store_true", help=f"keep about {_LARGEST} rows")
    parser.add_argument("file", nargs="?", metavar="FILE.csv")
    options = parser.parse_args()
    if options.file is None:
        print("No CSV file given.")
        return 0
    if not options.file.endswith(".csv"):
        print(f"File {options.file} is not a CSV file. Aborting.")
        return 0
    length = _LARGEST if options.max else options.length
    try:
        if length is None:
            output = make_sparse_skip(options.file, options.skip)
        else:
            output = make_sparse_length(options.file, length)
    except (OSError, ValueError) as error:
        print(f"sparse_csv.py: error: {error}", file=sys.stderr)
        return 1
    print(f"Created sparse CSV {output}")
    return 0
