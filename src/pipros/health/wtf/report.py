"""Output of rule results in Noetic's format."""

from __future__ import annotations

import os
import sys

from pipros.basics.printable import printable_lines
from pipros.health.wtf.context import WtfContext


def print_results(ctx: WtfContext) -> None:
    """Print the warnings and errors of a context; in colour on a terminal."""
    is_coloured = sys.stdout.isatty() and not os.environ.get("NO_COLOR")
    warning, error = (
        ("\x1b[1mWARNING\x1b[0m", "\x1b[31m\x1b[1mERROR\x1b[0m") if is_coloured else ("WARNING", "ERROR")
    )
    if not ctx.errors and not ctx.warnings:
        print("No errors or warnings")
        return
    if ctx.warnings:
        print(
            f"Found {len(ctx.warnings)} warning(s).\n"
            "Warnings are things that may be just fine, but are sometimes at fault\n"
        )
        for found in ctx.warnings:
            print(f"{warning} {printable_lines(found.msg)}")
        print()
    if ctx.errors:
        print(f"Found {len(ctx.errors)} error(s).\n")
        for found in ctx.errors:
            print(f"{error} {printable_lines(found.msg)}")
