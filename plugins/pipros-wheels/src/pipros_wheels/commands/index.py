"""`pipros index FOLDER`: writes an index for pip and a lock file for the wheels in a folder."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros_tools.cli.entry_point import command


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Write the files. Return the exit code, which is 1 if a wheel is invalid or a file cannot be written."""
    parser = ArgumentParser(
        prog="pipros index",
        description="Writes FOLDER/simple, an index for pip, and FOLDER/requirements.lock, with hashes, for "
        "the wheels in FOLDER. Any web server can serve it: pip install --index-url URL/simple/.",
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    arguments = parser.parse_args(argv)
    from pipros_wheels.index import LOCK_FILE, write_index

    errors: list[str] = []
    try:
        files = write_index(arguments.folder, errors)
    except (PiprosError, OSError) as error:
        print(f"pipros index: {error}", file=sys.stderr)
        return 1
    print(files[0])
    print(arguments.folder / LOCK_FILE)
    for line in errors:
        print(f"pipros index: left out: {line}", file=sys.stderr)
    return 1 if errors else 0
