"""`pipros env`: prints the variables that a workspace's setup files set, as shell code to evaluate."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.windows import ON_WINDOWS
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import CommandError, run

SHELLS = ("sh", "fish", "powershell", "cmd")


@command
def main(argv: Sequence[str] | None = None) -> int:
    parser = ArgumentParser(
        prog="pipros env",
        description="Print what a workspace's setup.bash would set, as shell commands: "
        'eval "$(pipros env ~/catkin_ws)" has the effect of sourcing the file. Without a workspace, '
        'eval "$(pipros env)" stands in for sourcing /opt/ros/noetic/setup.bash. In bash, zsh and fish, '
        "the commands also define roscd, rosls, rosed, roscp and completion. In PowerShell, the command is: "
        "pipros env | Out-String | Invoke-Expression. In cmd, it is: "
        """for /f "delims=" %%i in ('pipros env --shell cmd') do @set "%%i\"""",
    )
    parser.add_argument(
        "workspace", nargs="?", help="a workspace, or its devel or install folder (default: none)"
    )
    parser.add_argument("--shell", choices=SHELLS, default=_shell(), help="the shell (default: %(default)s)")
    parser.add_argument("--extend", action="store_true", help="keep the active workspaces as underlays")
    parser.add_argument("--json", action="store_true", help="print the changed variables as one JSON object")
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))

    def body() -> int:
        space = None if options.workspace is None else built_space(Path(options.workspace))
        from pipros_workspace.environment import environment_changes, print_code, setup_code
        from pipros_workspace.setup_files import functions_code

        if options.json:
            import json

            print(json.dumps(environment_changes(space, os.environ, extend=options.extend), indent=2))
        else:
            code = setup_code(space, os.environ, options.shell, extend=options.extend)
            print_code(code + functions_code(options.shell), options.shell)
        return 0

    return run(body)


def _shell() -> str:
    """Return `powershell` on Windows, unless a shell such as Git Bash has set `SHELL`."""
    return "powershell" if ON_WINDOWS and "SHELL" not in os.environ else "sh"


def built_space(folder: Path) -> Path:
    """Return the devel or install space that `folder` is or contains.

    Raises:
        CommandError: the folder has not been built.
    """
    from pipros_workspace.overlays import MARKER

    folder = folder.absolute()
    for space in (folder, folder / "devel", folder / "install"):
        if (space / MARKER).is_file():
            return space
    raise CommandError(
        f"[{folder}] is not a built workspace; run catkin_make there, or give its devel folder"
    )
