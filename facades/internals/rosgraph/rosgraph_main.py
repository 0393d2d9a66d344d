"""`rosgraph.rosgraph_main`: the command `rosgraph`."""

from __future__ import annotations

import sys
from typing import NoReturn

from pipros.basics.lazy_names import star_names as _star_names
from pipros.cli.rosgraph import main

_star_names(__name__, "rosgraph.impl.graph rosgraph.masterapi rosgraph.roslogging time")


def fullusage() -> NoReturn:
    """Print the usage of the command and exit with code 255."""
    sys.exit(main(["usage"]))


def rosgraph_main() -> None:
    """Run the command with the process's arguments. Exit with an error code if the arguments are invalid."""
    if code := main():
        sys.exit(code)
