"""`rosrun diagnostic_analysis export_csv.py`: write the diagnostics in bags to CSV files."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from diagnostic_analysis.exporter import LogExporter
from pipros.basics.errors import PiprosError


def main() -> int:
    """Write the CSV files for each bag. Return the exit code, which is 1 if reading or writing fails."""
    parser = argparse.ArgumentParser("export_csv.py", description="Writes recorded diagnostics to CSV files.")
    parser.add_argument(
        "-d",
        "--directory",
        default=".",
        metavar="DIR",
        help="write to DIR/output; DIR defaults to the current folder",
    )
    parser.add_argument("bags", nargs="*", metavar="BAG")
    options = parser.parse_args()
    output = Path(options.directory) / "output"
    print(f"Output directory: {os.path.join(options.directory, 'output')}")
    for number, bag in enumerate(options.bags, 1):
        print(f"Processing file {os.path.basename(bag)}. File {number} of {len(options.bags)}.")
        try:
            LogExporter(str(output), bag).process_log()
        except (OSError, PiprosError) as error:
            print(f"ERROR: {bag}: {error}", file=sys.stderr)
            return 1
    print("Finished processing files.")
    return 0
