"""Message definitions stored in a bag."""

from __future__ import annotations

from pathlib import Path

from pipros.bag.errors import BagError
from pipros.bag.reader import BagReader
from pipros.cli.runner import CommandError


def bag_definitions(path: Path) -> dict[str, str]:
    """Return the full definition of each topic's message type in a bag, keyed by type name.

    Raises:
        CommandError: the file does not exist, is not a bag, or has no readable index.
    """
    if not path.is_file():
        raise CommandError(f"bag file [{path}] does not exist")
    try:
        with BagReader(path) as bag:
            return {connection.type: connection.definition for connection in bag.connections}
    except BagError as error:
        raise CommandError(str(error)) from error
