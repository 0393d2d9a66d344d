"""`rosmsg show` and `rosmsg md5`, and the equivalents for `rossrv` and `rosaction`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from optparse import OptionParser
from pathlib import Path

from pipros.basics.errors import NotFound
from pipros.basics.similar_names import similar_names
from pipros.msg.dynamic import checked_specs
from pipros.msg.language.spec import DefinitionError
from pipros.packages.well_known import advice_on
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.reader import BagReader
from pipros_tools.cli.runner import USAGE_ERROR, CommandError, add_flag, option_parser
from pipros_workspace.type_catalogue import TypeCatalogue, expanded


def show(interfaces: TypeCatalogue, subcommand: str, argv: Sequence[str]) -> int:
    parser = option_parser(interfaces.command, f"{subcommand} [options] <{interfaces.noun} type>")
    add_flag(parser, "-r", "--raw", help="show raw message text, including comments")
    parser.add_option("-b", "--bag", metavar="BAGFILE", help="show message from .bag file")
    options, arguments = parser.parse_args(list(argv))
    names = _type_names(parser, interfaces, arguments)
    type_names = [each.removesuffix(f".{interfaces.kind}") for each in names]
    advice = "Please refer to msg/srv types as 'package_name/Type'."
    for name in type_names:
        if "::" in name:
            wrong = f"{interfaces.command} does not understand C++-style namespaces (i.e. '::')"
            parser.error(f"{wrong}.\n{advice}")
        if "." in name:
            parser.error(f"invalid message type '{name}'.\n{advice}")
    if options.bag is not None:
        return _show_from_bag(Path(options.bag), type_names, is_raw=options.raw)
    status = 0
    for name in type_names:
        status |= _show_one(interfaces, name, is_raw=options.raw)
    return status


def show_md5(interfaces: TypeCatalogue, subcommand: str, argv: Sequence[str]) -> int:
    parser = option_parser(interfaces.command, f"{subcommand} <{interfaces.noun} type>")
    _, arguments = parser.parse_args(list(argv))
    for name in _type_names(parser, interfaces, arguments):
        if interfaces.is_malformed(name):
            print(f"Invalid type: 'invalid name [{name}]'", file=sys.stderr)
            return USAGE_ERROR
        types = interfaces.types_named(name)
        if not types:
            print(
                f"No {interfaces.noun}s matching the name [{name}]".replace("services", "messages"),
                file=sys.stderr,
            )
            _print_advice(interfaces, name)
        for type_name in types:
            heading = "" if "/" in name else f"[{type_name}]: "
            try:
                print(f"{heading}{interfaces.md5(type_name)}")
            except NotFound:
                print(f"Cannot locate [{type_name}]", file=sys.stderr)
            except DefinitionError as error:
                _print_mistakes(f"Cannot locate [{type_name}]", error)
    return 0


def _show_one(interfaces: TypeCatalogue, name: str, *, is_raw: bool) -> int:
    types = interfaces.types_named(name) if name else []
    if not types:
        print(f"Could not find msg '{name}'", file=sys.stderr)
        _print_advice(interfaces, name)
        return 1
    status = 0
    for type_name in types:
        heading = "" if "/" in name else f"[{type_name}]:\n"
        try:
            print(f"{heading}{interfaces.text(type_name, is_raw=is_raw)}")
        except NotFound as error:
            print(f"{interfaces.unknown} [{type_name}]: {error}", file=sys.stderr)
            status = 1
        except DefinitionError as error:
            _print_mistakes(f"{interfaces.unknown} [{type_name}]", error)
            status = 1
    return status


def _print_advice(interfaces: TypeCatalogue, name: str) -> None:
    """Suggest types with similar names, or say where packages were searched."""
    known = (each for package in interfaces.packages() for each in interfaces.names(package))
    print(similar_names(name, known) or advice_on(name), file=sys.stderr)


def _show_from_bag(bag: Path, type_names: Sequence[str], *, is_raw: bool) -> int:
    """Show types as they are defined in a bag."""
    texts = bag_definitions(bag)
    status = 0
    for type_name in type_names:
        if type_name not in texts:
            print(f"Could not find msg '{type_name}' in [{bag}]", file=sys.stderr)
            status = 1
        elif is_raw:
            print(texts[type_name])
        else:
            specs = checked_specs(type_name, texts[type_name])
            print(expanded(specs[type_name], specs.__getitem__))
    return status


def _print_mistakes(beginning: str, error: DefinitionError) -> None:
    """Print every error in the file, not only the first."""
    for each in (error, *error.others):
        print(f"{beginning}: {each}", file=sys.stderr)


def _type_names(parser: OptionParser, interfaces: TypeCatalogue, arguments: Sequence[str]) -> list[str]:
    """Return the type on the command line or, without one, the types read from standard input.

    For example, `rostopic type /x | rosmsg show` reads one type.
    """
    if len(arguments) > 1:
        parser.error(f"you may only specify one {interfaces.noun} type")
    if arguments:
        return list(arguments)
    names = [] if sys.stdin is None or sys.stdin.isatty() else sys.stdin.read().split()
    if not names:
        parser.error("you must specify a message type")
    return names


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
