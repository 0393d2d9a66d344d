"""`rosmsg`, `rossrv`, `rosaction`: list and show message, service and action types."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import partial

from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import USAGE_ERROR, run
from pipros_workspace.type_catalogue import MESSAGES, TypeCatalogue

OVERVIEW = """\
{command} is a command-line tool for displaying information about ROS {Noun} types.

Commands:
\t{command} show\tShow {noun} description
\t{command} info\tAlias for {command} show
\t{command} list\tList all {noun}s
\t{command} md5\tDisplay {noun} md5sum
\t{command} package\tList {noun}s in a package
\t{command} packages\tList packages that contain {noun}s

Type {command} <command> -h for more detailed usage
"""

Body = Callable[[TypeCatalogue, str, Sequence[str]], int]


@command
def main(argv: Sequence[str] | None = None, interfaces: TypeCatalogue = MESSAGES) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    subcommand = _subcommand(arguments[0]) if arguments else None
    if subcommand is None:
        noun = interfaces.noun
        print(OVERVIEW.format(command=interfaces.command, noun=noun, Noun=noun.title()))
        return USAGE_ERROR if arguments and arguments[0] != "--help" else 0
    return run(partial(subcommand, interfaces, arguments[0], arguments[1:]))


def _subcommand(name: str) -> Body | None:
    from pipros_tools.cli.rosmsg import listing, show

    return {
        "show": show.show,
        "info": show.show,
        "md5": show.show_md5,
        "list": listing.list_types,
        "package": listing.list_package,
        "packages": listing.list_packages,
    }.get(name)
