"""`pipros stubs PKG…`: writes type stubs for the messages in packages, for completion in editors."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.interruptible_wait import OnceEvent, set_by_signals
from pipros_tools.cli.entry_point import command

if TYPE_CHECKING:
    from pipros.msg.stub_files import StubFiles

_WATCH_INTERVAL_S = 0.5


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
        "-w", "--watch", action="store_true", help="write stubs again when definitions change"
    )
    parser.add_argument(
        "--installable", action="store_true", help="name the folders PKG-stubs, to be installed (PEP 561)"
    )
    arguments = parser.parse_args(argv)
    from pipros.msg.stub_files import StubFiles

    suffix = "-stubs" if arguments.installable else ""
    stubs = StubFiles(arguments.packages, arguments.output, suffix=suffix)
    if not _update(stubs) and not arguments.watch:
        return 1
    if arguments.watch:
        over = OnceEvent()
        with set_by_signals(over):
            while not over.wait(_WATCH_INTERVAL_S):
                _update(stubs)
    return 0


def _update(stubs: StubFiles) -> bool:
    """Write the stubs of changed packages and print their paths. Print an error for each package without.

    Return False if an error was printed.
    """
    errors: list[Exception] = []
    for file in stubs.update(errors.append):
        print(file, flush=True)
    for error in errors:
        print(f"pipros stubs: {error}", file=sys.stderr, flush=True)
    return not errors
