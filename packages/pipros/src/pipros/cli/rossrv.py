"""`rossrv`: lists and shows service types. See `pipros.cli.rosmsg`."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.cli import rosmsg
from pipros.cli.entry_point import command
from pipros.workspace.type_catalogue import SERVICES


@command
def main(argv: Sequence[str] | None = None) -> int:
    return rosmsg.main(argv, SERVICES)
