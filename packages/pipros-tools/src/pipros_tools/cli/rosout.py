"""`rosrun rosout rosout`: the `/rosout` node as a separate process, for masters that do not have one."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics import names
from pipros.basics.env import Environment
from pipros.node.rosout import RosoutAggregator
from pipros.node.signals import ended_by_signals
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import run


@command
def main(argv: Sequence[str] | None = None) -> int:
    return run(lambda: _repeat(list(sys.argv[1:] if argv is None else argv)))


def _repeat(arguments: Sequence[str]) -> int:
    environment = Environment.from_os()
    special = names.parse_arguments(arguments).special
    master_uri = special.get("__master", environment.master_uri)
    environment = environment._replace(master_uri=master_uri, namespace="/")
    rosout = RosoutAggregator(environment, environment.log_dir.expanduser() / "rosout.log")
    rosout.open_log()
    try:
        with ended_by_signals(rosout.node):
            rosout.register()
            rosout.node.wait_for_shutdown()
    finally:
        rosout.stop()
    return 0
