"""`rosparam set`, `rosparam load` and `rosparam delete`: the subcommands that change parameters."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipros.basics import input_file
from pipros.basics.names import canonicalize
from pipros_tools.cli.rosparam.arguments import add_verbose_option, parse_name
from pipros_tools.cli.runner import CommandError, option_parser
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.param_files import parse_value
from pipros_tools.graph.params import delete, write

_NEGATIVE_NUMBER = re.compile(r"-\.?\d")
_VALUE_MARK = "\0"
"""Prefix added to negative numbers while options are parsed, because `-1` looks like an option."""


def set_parameter(argv: Sequence[str]) -> int:
    parser = option_parser("rosparam", "set [options] parameter value")
    parser.add_option(
        "-t",
        "--textfile",
        dest="text_file",
        metavar="TEXT_FILE",
        help="set parameters to contents of text file",
    )
    parser.add_option(
        "-b",
        "--binfile",
        dest="bin_file",
        metavar="BINARY_FILE",
        help="set parameters to contents of binary file",
    )
    add_verbose_option(parser)
    marked = [_VALUE_MARK + word if _NEGATIVE_NUMBER.match(word) else word for word in argv]
    options, arguments = parser.parse_args(marked)
    arguments = [word.removeprefix(_VALUE_MARK) for word in arguments]
    if options.text_file and options.bin_file:
        parser.error("you may only specify one of --textfile or --binfile")
    if options.text_file and not Path(options.text_file).is_file():
        parser.error(f"file '{options.text_file}' does not exist")
    if not arguments:
        parser.error("invalid arguments. Please specify a parameter name")
    if len(arguments) > 2:
        parser.error("too many arguments")
    if len(arguments) < 2 and not options.text_file and not options.bin_file:
        parser.error("invalid arguments. Please specify a parameter value")

    with GraphClient("rosparam") as graph:
        name = graph.resolve(arguments[0])
        if options.text_file:
            value: Any = _text(options.text_file)
        elif options.bin_file:
            value = _contents(options.bin_file)
        else:
            value = parse_value(arguments[1], name)
        written = write(graph.master, name, value)
    if options.verbose:
        for leaf, part in written:
            print(f"set parameter [{leaf}] to [{part}]")
    return 0


def _text(file: str) -> str:
    try:
        return _contents(file).decode("utf-8")
    except UnicodeDecodeError as error:
        raise CommandError(
            f"[{file}] is not UTF-8 text ({error.reason}); use -b to set binary data"
        ) from None


def _contents(file: str) -> bytes:
    try:
        return input_file.read_file(file)
    except OSError as error:
        raise CommandError(f"cannot read [{file}]: {error.strerror}") from None


def load_parameters(argv: Sequence[str]) -> int:
    parser = option_parser("rosparam", "load [options] file [namespace]")
    add_verbose_option(parser)
    options, arguments = parser.parse_args(list(argv))
    if not arguments:
        parser.error("invalid arguments. Please specify a file name or - for stdin")
    if len(arguments) > 2:
        parser.error("too many arguments")
    from pipros_tools.graph.param_files import read_file, read_text

    file = arguments[0]
    with GraphClient("rosparam") as graph:
        ns = graph.resolve(arguments[1] if len(arguments) > 1 else "")
        documents = read_text(sys.stdin.read(), "stdin", ns) if file == "-" else read_file(file, ns)
        if options.verbose:
            print(f"reading parameters from {'stdin' if file == '-' else f'[{file}]'}")
        for values, own_ns in documents:
            if options.verbose and own_ns != ns:
                print(f"reading parameters into namespace [{own_ns}]")
            if canonicalize(own_ns) == "/" and not isinstance(values, dict):
                raise CommandError("global / can only be set to a dictionary")
            for leaf, part in write(graph.master, own_ns, values):
                if options.verbose:
                    print(f"{leaf}={part}")
    return 0


def delete_parameter(argv: Sequence[str]) -> int:
    parser = option_parser("rosparam", "delete [options] parameter")
    add_verbose_option(parser)
    options, name = parse_name(parser, argv)
    with GraphClient("rosparam") as graph:
        name = graph.resolve(name)
        delete(graph.master, name)
    if options.verbose:
        print(f"deleted parameter [{name}]")
    return 0
