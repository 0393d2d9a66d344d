"""`rosgraph.rosgraph_main`: the command `rosgraph`."""

from __future__ import annotations

import sys
from typing import NoReturn

from pipros.cli.rosgraph import main
from pipros.lazy_names import star_names as _star_names

_star_names(__name__, "rosgraph.impl.graph rosgraph.masterapi rosgraph.roslogging time")


def fullusage() -> NoReturn:
    """Prints how to use the command, and ends the process with code 255."""
    sys.exit(main(["usage"]))


def rosgraph_main() -> None:
    """The command, with the arguments of the process. Ends the process when it was not used rightly."""
    if code := main():
        sys.exit(code)
