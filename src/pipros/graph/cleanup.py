"""Unregisters nodes that do not answer from the master, after asking the user."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from pipros.graph.nodes import unregister
from pipros.graph.output import bullets, to_stdout
from pipros.graph.ping import ping_all
from pipros.net.master_client import MasterClient
from pipros.printable import listed

if TYPE_CHECKING:
    from pipros.printable import Say

WARNING = """\
Warning: these might include alive and functioning nodes, e.g. in unstable networks.
Cleanup will purge all information about these nodes from the master.
Please type y or n to continue:"""


def clean_up(master: MasterClient, *, say: Say = to_stdout) -> None:
    """Pings every node, asks on standard input, and unregisters those that did not answer."""
    _, unreachable = ping_all(master)
    if not unreachable:
        return
    say(bullets("Unable to contact the following nodes:", unreachable))
    say(WARNING)
    if not _agrees():
        say("aborting")
        return
    for node in unreachable:
        say(f"Unregistering {listed(node)}")
        unregister(master, node)
    say("done")


def _agrees() -> bool:
    """True when the user types y, False for n and at the end of the input."""
    for line in sys.stdin:
        answer = line.strip()
        if answer in ("y", "n"):
            return answer == "y"
    return False
