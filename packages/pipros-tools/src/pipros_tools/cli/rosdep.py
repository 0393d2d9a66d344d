"""`rosdep`: a program of the plugin for wheels, which is installed under this name with or without it."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.plugin_table import NOT_INSTALLED, why_no_command
from pipros.basics.plugins import loaded, plugins
from pipros_tools.cli.entry_point import command

_NAME = "rosdep"


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the plugin's program, or print the command that installs it, and return the exit code."""
    program = next((each.programs[_NAME] for each in plugins() if _NAME in each.programs), None)
    if program is None:
        print(f"ERROR: {why_no_command(_NAME)}", file=sys.stderr)
        return NOT_INSTALLED
    run = loaded(program.target)
    return int(run(argv))
