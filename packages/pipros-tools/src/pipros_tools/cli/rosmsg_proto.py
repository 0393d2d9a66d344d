"""`rosmsg-proto`: prints an empty message as YAML, for shell completion of `rostopic pub /topic type`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class, load_service_class
from pipros.msg.base import Message
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import USAGE_ERROR, add_flag, option_parser, run
from pipros_tools.graph.skeleton import skeleton
from pipros_workspace.type_catalogue import MESSAGES, SERVICES

if TYPE_CHECKING:
    from optparse import OptionParser

FLOW_STYLES = {0: False, 1: True}


class NoPrototype(PiprosError):
    """A message cannot be created, for example because its type does not exist.

    Attributes:
        exit_code: the command's exit code.
    """

    def __init__(self, text: str, exit_code: int = 1) -> None:
        self.exit_code = exit_code
        super().__init__(text)


@command
def main(argv: Sequence[str] | None = None) -> int:
    def body() -> int:
        try:
            text = _prototype(sys.argv[1:] if argv is None else argv)
        except NoPrototype as error:
            sys.stderr.write(str(error))
            return error.exit_code
        if text is not None:
            print(text)
        return 0

    return run(body)


def _prototype(argv: Sequence[str]) -> str | None:
    """Return the text that the command prints, without a trailing newline.

    Return None if the message cannot be created and the option `--silent` is given.

    Raises:
        NoPrototype: the message cannot be created.
        SystemExit: an option is invalid, or the type contains `::` or a dot.
    """
    parser = _parser()
    options, arguments = parser.parse_args(list(argv))
    try:
        kind, name = _kind_and_name(arguments)
        if not options.silent:
            _check_separators(parser, name)
        message = example(kind, name)
    except NoPrototype:
        if options.silent:
            return None
        raise
    excluded = options.exclude.split(",")
    text = skeleton(
        message, FLOW_STYLES.get(options.flow_style), excluded, fill_arrays=not options.empty_arrays
    )
    text = "\n".join(options.prefix + line for line in text.splitlines())
    return text if options.no_hyphens else f'"{text}"'


def _kind_and_name(arguments: Sequence[str]) -> tuple[str, str]:
    if len(arguments) < 2:
        raise NoPrototype("Insufficient arguments", USAGE_ERROR)
    return arguments[0], arguments[1]


def _check_separators(parser: OptionParser, name: str) -> None:
    rule = "Please refer to msg/srv types as 'package_name/Type'."
    if "::" in name:
        parser.error(f"rosmsgproto does not understand C++-style namespaces (i.e. '::').\n{rule}")
    if "." in name:
        parser.error(f"invalid message type '{name}'.\n{rule}")


def _parser() -> OptionParser:
    description = "Produces output or a msg or service request, intended for tab completion support."
    parser = option_parser("rosmsg-proto", "", description)
    parser.set_usage("usage: rosmsgproto msg/srv [options]")
    add, flag = parser.add_option, partial(add_flag, parser)
    flow_style = "if 1 always use brackets, if 0 never use brackets. Default is a heuristic mix."
    add("-f", "--flow_style", type="int", metavar="FLOW_STYLE", help=flow_style)
    empty_arrays = "if true flexible size arrays are not filled with default instance"
    flag("-e", "--empty-arrays", help=empty_arrays)
    flag("-s", "--silent", help="if true suppresses all error messages")
    prefix = "prefix to print before each line, can be used for indent"
    add("-p", "--prefix", metavar="prefix", default="", help=prefix)
    flag("-H", "--no-hyphens", help="if true output has no outer hyphens")
    exclude = "comma separated list of slot names not to print"
    add("-x", "--exclude-slots", dest="exclude", metavar="exclude_slots", default="", help=exclude)
    return parser


def example(kind: str, name: str) -> Message:
    """Return an empty message or service request.

    Args:
        kind: `msg` or `srv`.
        name: the type. If the name does not include a package, all packages are searched.

    Raises:
        NoPrototype: the kind or the type is invalid, the type cannot be loaded, or several packages define
            a type of this name.
    """
    if kind not in ("msg", "srv"):
        raise NoPrototype(f"Invalid mode: .{kind}")
    interfaces, noun = (MESSAGES, "message") if kind == "msg" else (SERVICES, "service")
    if interfaces.is_malformed(name):
        raise NoPrototype(f"Invalid type: 'invalid name [{name}]'", USAGE_ERROR)
    found = interfaces.types_named(name)
    if len(found) != 1:
        raise NoPrototype(f"{'Ambiguous' if found else 'Unknown'} message name {name}")
    try:
        if kind == "msg":
            message: Message = load_message_class(found[0])()
            return message
        request: Message = load_service_class(found[0])._request_class()
    except PiprosError:
        raise NoPrototype(f"Unknown {noun} class: {found[0]}") from None
    return request
