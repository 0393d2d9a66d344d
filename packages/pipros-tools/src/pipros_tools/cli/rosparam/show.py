"""`rosparam get`, `rosparam list` and `rosparam dump`: the subcommands that read parameters."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence

from pipros.basics.printable import listed, printable_lines
from pipros_tools.cli.rosparam.arguments import add_verbose_option, parse_name
from pipros_tools.cli.runner import CommandError, add_flag, option_parser
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.param_text import as_document, as_pretty_text, as_shown, node_parameters
from pipros_tools.graph.params import leaves, names_below, read


def get_parameter(argv: Sequence[str]) -> int:
    parser = option_parser("rosparam", "get [options] parameter")
    add_flag(parser, "-p", dest="pretty", help="pretty print. WARNING: not YAML-safe")
    add_verbose_option(parser)
    options, name = parse_name(parser, argv)
    with GraphClient("rosparam") as graph:
        name = graph.resolve(name)
        if options.verbose:
            print(f"getting parameter [{name}]")
        value = read(graph.master, name)
    if options.pretty and isinstance(value, Mapping):
        print(as_pretty_text(value), end="")
    elif options.pretty and isinstance(value, str):
        print(printable_lines(value))
    else:
        print(as_shown(value), end="")
    return 0


def list_parameters(argv: Sequence[str]) -> int:
    parser = option_parser("rosparam", "list [namespace]")
    _, arguments = parser.parse_args(list(argv))
    if len(arguments) > 1:
        parser.error("too many arguments")
    with GraphClient("rosparam") as graph:
        ns = graph.resolve(arguments[0]) if arguments else "/"
        print("\n".join(map(listed, names_below(graph.master, ns))))
    return 0


def dump_parameters(argv: Sequence[str]) -> int:
    parser = option_parser("rosparam", "dump [options] file [namespace]")
    add_verbose_option(parser)
    words, node = list(argv), ""
    if "--ros2" in words:  # no option of the parser, whose help is that of genuine rosparam
        at = words.index("--ros2")
        node = next(iter(words[at + 1 : at + 2]), "")
        if not node:
            parser.error("--ros2 option requires 1 argument")
        del words[at : at + 2]
    options, arguments = parser.parse_args(words)
    if len(arguments) > (1 if node else 2):
        parser.error("too many arguments")
    with GraphClient("rosparam") as graph:
        ns = graph.resolve(node or (arguments[1] if len(arguments) > 1 else "/"))
        tree = read(graph.master, ns)
    if node:
        tree, left_out = node_parameters(ns, tree)
        for name, reason in left_out.items():
            print(f"WARNING: {printable_lines(name)} is left out: {reason}", file=sys.stderr)
    if not arguments:
        print(as_document(tree), end="")
        return 0
    from pathlib import Path

    from pipros.basics.replaced_file import overwritten_file

    file = arguments[0]
    if options.verbose:
        print(f"dumping namespace [{ns}] to file [{file}]")
        for name, value in leaves(ns, tree):
            print(printable_lines(f"{name}={value}"))
    try:
        with overwritten_file(Path(file)) as opened:
            opened.write(as_document(tree).encode())
    except OSError as error:
        raise CommandError(f"cannot write [{file}]: {error.strerror}") from None
    return 0
