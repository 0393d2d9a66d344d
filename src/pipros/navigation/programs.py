"""Start the programs of the navigation packages. These programs need the extra `navigation`."""

from __future__ import annotations

import sys
from importlib import import_module

from pipros.basics.errors import MissingExtra


def run_program(module: str, *arguments: str) -> int:
    """Run `main` in a module of `pipros.navigation`, and return the exit code.

    Without the required libraries, print an error and return 1.
    """
    try:
        program = import_module(f"pipros.navigation.{module}")
    except MissingExtra as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return 1
    return int(program.main(*arguments))
