"""`rosaction`: lists and shows action types. See `pipros_tools.cli.rosmsg`."""

from __future__ import annotations

from collections.abc import Sequence

from pipros_tools.cli import rosmsg
from pipros_tools.cli.entry_point import command
from pipros_workspace.type_catalogue import ACTIONS


@command
def main(argv: Sequence[str] | None = None) -> int:
    return rosmsg.main(argv, ACTIONS)
