"""`pipros stubs PKG…`: writes type stubs for the messages in packages, so that editors know their fields."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.cli.entry_point import command


@command
def main(argv: Sequence[str] | None = None) -> int:
    parser = ArgumentParser(
        prog="pipros stubs",
        description="Writes type stubs for the messages and services of ROS packages. Editors that use "
        "pyright read the folder typings without configuration; mypy needs mypy_path = typings.",
    )
    parser.add_argument("packages", nargs="+", metavar="PKG")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("typings"), metavar="DIR", help="default: typings"
    )
    parser.add_argument(
        "--installable", action="store_true", help="name the folders PKG-stubs, to be installed (PEP 561)"
    )
    arguments = parser.parse_args(argv)
    from pipros.msg.importing.hook import installed_library
    from pipros.msg.stubs import write_stubs

    try:
        written = write_stubs(
            arguments.packages,
            arguments.output,
            installed_library().definitions,
            suffix="-stubs" if arguments.installable else "",
        )
    except (PiprosError, OSError) as error:
        print(f"pipros stubs: {error}", file=sys.stderr)
        return 1
    for file in written:
        print(file)
    return 0
