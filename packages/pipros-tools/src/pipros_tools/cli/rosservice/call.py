"""`rosservice call`: calls a service and prints the response."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipros.basics.names import parse_arguments
from pipros.basics.printable import printable_lines
from pipros.basics.similar_names import similar_names
from pipros_tools.cli.runner import add_flag, option_parser
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.elide import Elision
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.message_path import Part
from pipros_tools.graph.service_call import ServiceCaller, wait_for_service
from pipros_tools.graph.system_state import SystemState

if TYPE_CHECKING:
    from optparse import OptionParser


def call_service(argv: Sequence[str]) -> int:
    parser = option_parser("rosservice", "call /service [args...]")
    parser.add_option("-v", dest="verbose", action="store_true", default=False, help="print verbose output")
    parser.add_option(
        "--wait",
        dest="wait",
        action="store_true",
        default=False,
        help="wait for service to be advertised",
    )
    add_flag(parser, "--nostr", dest="no_texts", help="exclude string fields")
    add_flag(parser, "--noarr", dest="no_arrays", help="exclude arrays")
    options, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    if not arguments:
        parser.error("service must be specified")
    from pipros.safe.yaml import YamlError

    try:
        return _call(parser, options, arguments)
    except YamlError as error:  # of the errors after options, the only one with exit code 1
        sys.exit(f"ERROR: {printable_lines(str(error))}")


def _call(parser: OptionParser, options: Any, arguments: Sequence[str]) -> int:
    from pipros_tools.cli.yaml_args import documents_of, value_of

    with GraphClient("rosservice") as graph:
        service = graph.resolve(arguments[0])
        if options.wait:
            wait_for_service(graph.master, service)
        try:
            caller = ServiceCaller(graph.master, service)
        except GraphError as error:
            raise GraphError(f"{error}{_suggestion(graph, service)}") from None
        if arguments[1:] or not caller.takes_arguments:
            _print_call(caller, [value_of(word) for word in arguments[1:]], options)
            return 0
        if sys.stdin.isatty():
            parser.error("Please specify service arguments")
        for document in documents_of(sys.stdin):
            _print_call(caller, [document], options)
    return 0


def _suggestion(graph: GraphClient, service: str) -> str:
    """Return a line that suggests similar services, to append to an error; empty if there are none."""
    known = SystemState.from_state(graph.master.get_system_state()).services
    question = "" if service in known else similar_names(service, known)
    return f"\n{question}" if question else ""


def _print_call(caller: ServiceCaller, values: Sequence[Any], options: Any) -> None:
    """Call the service and print its response. If `options.verbose` is true, print the request, too."""
    request = caller.request(values)
    response = caller.call(request)
    if options.verbose:
        print(f"{request}\n---")
    if options.no_texts or options.no_arrays:
        elision = Elision(no_arrays=options.no_arrays, no_texts=options.no_texts)
        response = elision.of(Part(response, response._type))
    print(response, flush=True)
