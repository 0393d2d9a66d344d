"""`rosmsg-proto`: prints an empty message as YAML, for shell completion of `rostopic pub /topic type`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.cli.entry_point import command
from pipros.cli.runner import USAGE_ERROR, add_flag, option_parser, run
from pipros.graph.skeleton import skeleton
from pipros.msg import load_message_class, load_service_class
from pipros.msg.base import Message
from pipros.workspace.type_catalogue import MESSAGES, SERVICES

if TYPE_CHECKING:
    from optparse import OptionParser

FLOW_STYLES = {0: False, 1: True}


@command
def main(argv: Sequence[str] | None = None) -> int:
    parser = _parser()
    options, arguments = parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    if len(arguments) < 2 or arguments[0] not in ("msg", "srv"):
        sys.stderr.write("Insufficient arguments")
        return USAGE_ERROR

    def body() -> int:
        try:
            message = example(arguments[0], arguments[1])
        except UnknownInterface as error:
            if options.silent:
                return 0
            sys.stderr.write(str(error))
            return 1
        excluded = options.exclude.split(",")
        text = skeleton(
            message, FLOW_STYLES.get(options.flow_style), excluded, fill_arrays=not options.empty_arrays
        )
        text = "\n".join(options.prefix + line for line in text.splitlines())
        print(text if options.no_hyphens else f'"{text}"')
        return 0

    return run(body)


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


class UnknownInterface(PiprosError):
    """The message or service does not exist."""


def example(kind: str, name: str) -> Message:
    """Return an empty message or service request.

    If the name does not include a package, search all packages.

    Raises:
        UnknownInterface: no package defines the message or service.
    """
    interfaces, noun = (MESSAGES, "message") if kind == "msg" else (SERVICES, "service")
    found = interfaces.types_named(name)
    if not found:
        raise UnknownInterface(f"Unknown {noun} name {name}")
    try:
        if kind == "msg":
            return load_message_class(found[0])()
        request: Message = load_service_class(found[0])._request_class()
    except PiprosError:
        raise UnknownInterface(f"Unknown {noun} class: {found[0]}") from None
    return request
