"""Start the programs of simulated robots. These programs need numpy."""

from __future__ import annotations

import sys
from importlib import import_module

from pipros.basics.errors import MissingExtra


def run_program(module: str) -> int:
    """Run `main` in a module of `pipros_simulation.robots`, and return the exit code.

    If numpy is missing, print an error and return 1.
    """
    try:
        program = import_module(f"pipros_simulation.robots.{module}")
    except MissingExtra as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return 1
    return int(program.main())
