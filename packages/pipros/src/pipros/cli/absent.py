"""Stand-ins for commands that the installed wheel omits. They print which room provides the command.

The build of the wheel adds `left_out.json`, which maps each omitted command to its room. A source tree does
not contain this file.
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
    """Return why a command is not installed, or None if the wheel does not omit it.

    `folder` contains `left_out.json`; it defaults to the folder of the installed package.
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
    """Print why the program is not installed, and return the exit code 127."""
    name = os.path.basename(sys.argv[0])
    print(f"ERROR: {why_absent(name) or f'{name} is not installed'}", file=sys.stderr)
    return NOT_INSTALLED
