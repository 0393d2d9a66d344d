"""`pipros`: commands that Noetic lacks, and a list of all commands."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import pipros
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import USAGE_ERROR, CommandError, dispatch, run
from pipros_tools.cli.subcommands import SUBCOMMANDS, subcommands


def overview() -> str:
    """Return the text that is printed without a subcommand."""
    lines = "".join(f"\tpipros {name}\t{each.purpose}\n" for name, each in sorted(subcommands().items()))
    return (
        f"pipros {pipros.__version__}: ROS 1 from pip. ROS commands keep their names: roscore, "
        "rostopic, …\n\n"
        f"Commands:\n{lines}\n"
        "Type pipros <command> -h for more detailed usage, pipros --help for a list of all commands\n"
    )


@command
def main(argv: Sequence[str] | None = None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments == ["--version"]:
        print(pipros.__version__)
        return 0
    if arguments[:1] in (["--help"], ["-h"], ["help"]):
        from pipros_tools.cli.command_map import command_map

        print(command_map())
        return 0
    return run(lambda: _main(arguments))


def _main(arguments: list[str]) -> int:
    name = arguments[0] if arguments else ""
    found = SUBCOMMANDS if name in SUBCOMMANDS else subcommands()
    if name not in found:
        from pipros.basics.plugin_table import why_no_command

        reason = why_no_command(f"pipros {name}")
        if reason is not None:
            raise CommandError(reason)
        print(overview())
        return USAGE_ERROR if arguments else 0
    return dispatch({name: found[name].target}, arguments, "", USAGE_ERROR)
