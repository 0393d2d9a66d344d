"""`rosnode cleanup`: takes nodes that do not answer off the master's books."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.cli.program import Surroundings, bullets, option_parser
from pipros.cli.rosnode.ping import ping_all
from pipros.errors import Refused
from pipros.graph.picture import Picture, of_node
from pipros.net.master import MasterClient

WARNING = """\
Warning: these might include alive and functioning nodes, e.g. in unstable networks.
Cleanup will purge all information about these nodes from the master.
Please type y or n to continue:"""


def clean_up(argv: Sequence[str]) -> int:
    option_parser("rosnode", "cleanup").parse_args(list(argv))
    with Surroundings("rosnode") as here:
        _, unreachable = ping_all(here.master)
        if not unreachable:
            return 0
        print(bullets("Unable to contact the following nodes:", unreachable), WARNING, sep="\n")
        if not _agrees():
            print("aborting")
            return 0
        for node in unreachable:
            print(f"Unregistering {node}")
            unregister(here.master, node)
        print("done")
    return 0


def _agrees() -> bool:
    """True when a person types y; the end of the input is a no."""
    sys.stdout.flush()
    for line in sys.stdin:
        answer = line.strip()
        if answer in ("y", "n"):
            return answer == "y"
    return False


def unregister(master: MasterClient, node: str) -> None:
    """Removes all registrations of a node, in its name, as if it had done it itself."""
    picture = Picture.from_state(master.get_system_state())
    try:
        api = master.lookup_node(node)
    except Refused:  # gone by itself
        return
    itself = MasterClient(master.uri, node)
    try:
        for topic in of_node(node, picture.publishers):
            itself.unregister_publisher(topic, api)
        for topic in of_node(node, picture.subscribers):
            itself.unregister_subscriber(topic, api)
        for service in of_node(node, picture.services):
            itself.unregister_service(service, itself.lookup_service(service))
    finally:
        itself.close()
