"""The commands of rooms that were left out of the installed wheel, which say so.

The build writes `left_out.json` into the wheel: for each such command, the room to which it belongs. A source
tree has no such file.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence

import pipros
from pipros.cli.entry_point import command

LEFT_OUT = "left_out.json"
NOT_INSTALLED = 127
"""The exit code of a shell that does not find a command."""


def why_absent(name: str, folder: str | None = None) -> str | None:
    """Return why a command is not installed, or None if it belongs to no room that was left out.

    `folder` is that of `left_out.json`, by default the installed package.
    """
    try:
        path = os.path.join(folder or os.path.dirname(pipros.__file__), LEFT_OUT)
        with open(path, encoding="utf-8") as file:
            room, purpose = json.load(file)[name]
    except (FileNotFoundError, KeyError):
        return None
    return f"{name} is not installed: it belongs to the room {room} ({purpose}), which this wheel leaves out"


@command
def main(argv: Sequence[str] | None = None) -> int:  # noqa: ARG001
    """Stand in for a program that was left out."""
    name = os.path.basename(sys.argv[0])
    print(f"ERROR: {why_absent(name) or f'{name} is not installed'}", file=sys.stderr)
    return NOT_INSTALLED
