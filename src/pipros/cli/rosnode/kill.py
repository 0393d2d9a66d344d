"""`rosnode kill`."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence

from pipros.cli.program import Surroundings, bullets, option_parser
from pipros.cli.rosnode.listing import node_names
from pipros.errors import PiprosError, Refused
from pipros.net.master import MasterClient
from pipros.net.rpc import RpcClient

DEADLINE_S = 5.0


def kill_nodes(argv: Sequence[str]) -> int:
    parser = option_parser("rosnode", "kill [node]...")
    parser.add_option("-a", "--all", dest="all", action="store_true", help="kill all nodes")
    options, arguments = parser.parse_args(list(argv))
    if options.all and arguments:
        parser.error("invalid arguments with kill all (-a) option")
    with Surroundings("rosnode") as here:
        known = node_names(here.master)
        if options.all:
            nodes = known
        elif arguments:
            nodes = [here.resolve(name) for name in arguments]
        else:
            nodes = [_ask(known)]
        if unknown := [node for node in nodes if node not in known]:
            print(bullets("ERROR: Unknown node(s):", unknown), file=sys.stderr)
            return 1
        if len(nodes) > 1:
            print(bullets("killing:", nodes))
        elif nodes:
            print(f"killing {nodes[0]}")
        _, failed = kill(here.master, nodes)
    if failed:
        print(bullets("ERROR: Failed to kill:", failed), file=sys.stderr)
        return 1
    print("killed")
    return 0


def _ask(nodes: Sequence[str]) -> str:
    """Has a person choose one of the nodes."""
    for number, node in enumerate(nodes, 1):
        print(f"{number}. {node}")
    print("\nPlease enter the number of the node you wish to kill.\n> ", end="", flush=True)
    for answer in sys.stdin:
        if answer.strip().isdecimal() and 1 <= int(answer) <= len(nodes):
            return nodes[int(answer) - 1]
        print("ERROR: please enter a number (ctrl-C to cancel)")
    raise KeyboardInterrupt  # the end of the input is the same as Ctrl-C


def kill(master: MasterClient, nodes: Sequence[str]) -> tuple[list[str], list[str]]:
    """Asks nodes to end. Returns those that were asked, and those that the master does not know.

    A node that does not answer counts as ended: nothing of it is left, or it died of the request.
    """
    killed, failed = [], []
    for node in nodes:
        try:
            api = master.lookup_node(node)
        except Refused:
            failed.append(node)
            continue
        with contextlib.suppress(PiprosError, ValueError), RpcClient(api, timeout_s=DEADLINE_S) as client:
            client.call("shutdown", master.caller_id, "user request")
        killed.append(node)
    return killed, failed
