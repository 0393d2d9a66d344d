"""`rosmsg list`, `rosmsg package`, `rosmsg packages`, and the equivalents for `rossrv` and `rosaction`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.errors import NotFound
from pipros_tools.cli.runner import USAGE_ERROR, add_flag, option_parser, single_argument
from pipros_workspace.index import PackageIndex
from pipros_workspace.type_catalogue import TypeCatalogue


def list_types(interfaces: TypeCatalogue, subcommand: str, argv: Sequence[str]) -> int:
    option_parser(interfaces.command, subcommand).parse_args(list(argv))
    for package in interfaces.packages():
        for name in interfaces.names(package):
            print(f"{package}/{name}")
    return 0


def list_packages(interfaces: TypeCatalogue, subcommand: str, argv: Sequence[str]) -> int:
    parser = option_parser(interfaces.command, subcommand)
    add_flag(parser, "-s", dest="is_one_line", help="list all packages on a single line")
    options, _ = parser.parse_args(list(argv))
    print((" " if options.is_one_line else "\n").join(interfaces.packages()))
    return 0


def list_package(interfaces: TypeCatalogue, subcommand: str, argv: Sequence[str]) -> int:
    parser = option_parser(interfaces.command, f"{subcommand} <package>")
    add_flag(parser, "-s", dest="is_one_line", help="list all msgs on a single line")
    options, arguments = parser.parse_args(list(argv))
    if not arguments and sys.stdin is not None and not sys.stdin.isatty():
        arguments = sys.stdin.read().split()
    package = single_argument(
        parser,
        arguments,
        missing="you must specify a package",
        several=f"you may only specify one {interfaces.noun} type",
    )
    try:
        types = [f"{package}/{name}" for name in interfaces.names(package)]
    except NotFound:
        print(f"Invalid package: {package}", file=sys.stderr)
        for number, folder in enumerate(PackageIndex.from_environment().folders):
            print(f"ROS path [{number}]={folder}", file=sys.stderr)
        return USAGE_ERROR
    print((" " if options.is_one_line else "\n").join(types))
    return 0
