"""`rosgraph`: prints the connections between nodes, and again after each change, until the master ends."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from pipros.basics.errors import Unreachable
from pipros.basics.names import without_launch_arguments
from pipros.basics.printable import printable
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import run
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.errors import NO_MASTER
from pipros_tools.graph.system_state import SystemState

USAGE = """\
rosgraph is a command-line tool for debugging the ROS Computation Graph.

Usage:
\trosgraph
"""

USAGE_ERROR = 255
"""Noetic's exit code when the usage is printed without `-h` or `--help`."""

POLL_INTERVAL_S = 1.0


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = without_launch_arguments(sys.argv[1:] if argv is None else argv)
    if arguments:
        print(USAGE)
        return 0 if arguments[0] in ("-h", "--help") else USAGE_ERROR
    return run(_follow)


def _follow() -> int:
    before = ""
    with GraphClient("rosgraph") as graph:
        while True:
            try:
                now = describe(SystemState.from_state(graph.master.get_system_state()))
            except Unreachable:
                sys.stdout.flush()
                print(f"ERROR: {NO_MASTER}", file=sys.stderr)
                return 0
            if now != before:
                print(f"\n\n{now}", flush=True)
                before = now
            time.sleep(POLL_INTERVAL_S)


def describe(state: SystemState) -> str:
    """Return a text that lists the registered nodes, with inbound and outbound peers, and the services."""
    inbound: dict[str, set[str]] = {node: set() for node in state.nodes()}
    outbound: dict[str, set[str]] = {node: set() for node in state.nodes()}
    for topic, publishers in state.publishers.items():
        for subscriber in state.subscribers.get(topic, ()):
            inbound[subscriber].update(publishers)
            for publisher in publishers:
                outbound[publisher].add(subscriber)
    lines = ["Nodes:"]
    for node in state.nodes():
        lines += [f"  {node} :", "    Inbound:", *(f"      {peer}" for peer in sorted(inbound[node]))]
        lines += ["    Outbound:", *(f"      {peer}" for peer in sorted(outbound[node]))]
    lines += ["Services:", *(f"  {service}" for service in sorted(state.services))]
    return "\n".join(printable(line, len(line)) for line in lines)
