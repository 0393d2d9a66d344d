"""`rossrv`: lists and shows service types. See `pipros_tools.cli.rosmsg`."""

from __future__ import annotations

from collections.abc import Sequence

from pipros_tools.cli import rosmsg
from pipros_tools.cli.entry_point import command
from pipros_workspace.type_catalogue import SERVICES


@command
def main(argv: Sequence[str] | None = None) -> int:
    return rosmsg.main(argv, SERVICES)
