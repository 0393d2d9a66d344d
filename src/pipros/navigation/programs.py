"""Start the programs of the navigation packages. These programs need the extra `navigation`."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from importlib import import_module

from pipros.basics.errors import Interrupted, MissingExtra
from pipros.navigation.extras import missing_extra
from pipros.navigation.parameters import InvalidParameter
from pipros.navigation.schedule import Schedule
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program


def run_program(module: str, *arguments: str) -> int:
    """Run `main` in a module of `pipros.navigation`, and return the exit code.

    Without the required libraries, print an error and return 1.
    """
    try:
        program = import_module(f"pipros.navigation.{module}")
    except (MissingExtra, ModuleNotFoundError) as error:
        if not isinstance(error, MissingExtra) and error.name not in ("numpy", "cv2"):
            raise
        reason = error if isinstance(error, MissingExtra) else missing_extra(error)
        print(f"ERROR: {reason}", file=sys.stderr)
        return 1
    return int(program.main(*arguments))


def run_node(name: str, package: str, make: Callable[[Node, logging.Logger, Schedule], object]) -> int:
    """Run a node until it is shut down; `make` connects it. Return 1 if a parameter is invalid."""
    with roscpp_program(name, package) as (node, log):
        schedule = Schedule(node)
        try:
            make(node, log, schedule)
        except InvalidParameter as error:
            log.critical("%s", error)
            return 1
        except Interrupted:
            return 0
        schedule.start()
        node.wait_for_shutdown()
    return 0
