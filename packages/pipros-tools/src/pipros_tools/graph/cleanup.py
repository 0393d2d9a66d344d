"""Unregister unresponsive nodes from the master, after confirmation by the user."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from pipros.basics.printable import listed
from pipros.net.master_client import MasterClient
from pipros_tools.graph.nodes import unregister
from pipros_tools.graph.output import bullets, to_stderr, to_stdout
from pipros_tools.graph.ping import ask_pid, ping_all

if TYPE_CHECKING:
    from pipros.basics.printable import Say

WARNING = """\
Warning: these might include alive and functioning nodes, e.g. in unstable networks.
Cleanup will purge all information about these nodes from the master.
Please type y or n to continue:"""


def clean_up(
    master: MasterClient,
    *,
    say: Say = to_stdout,
    complain: Say = to_stderr,
    answers: Iterable[str] | None = None,
    ask: Callable[[str, str], object] = ask_pid,
    remove: Callable[[MasterClient, str], object] = unregister,
) -> None:
    """Ping every node and, if the user confirms, unregister the nodes that did not respond.

    Args:
        answers: lines typed by the user; defaults to standard input.
        ask: function that pings the node at a URI on behalf of a caller.
        remove: function that unregisters a node.
    """
    _, unreachable = ping_all(master, complain=complain, ask=ask)
    if not unreachable:
        return
    say(bullets("Unable to contact the following nodes:", unreachable))
    say(WARNING)
    if not _is_confirmed(sys.stdin if answers is None else answers):
        say("aborting")
        return
    for node in unreachable:
        say(f"Unregistering {listed(node)}")
        remove(master, node)
    say("done")


def _is_confirmed(answers: Iterable[str]) -> bool:
    """Return True if the user types y, or False if the user types n or the input ends."""
    for line in answers:
        answer = line.strip()
        if answer in ("y", "n"):
            return answer == "y"
    return False
