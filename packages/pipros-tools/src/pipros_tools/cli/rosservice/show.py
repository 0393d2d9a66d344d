"""The subcommands of `rosservice` that print information."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.names import parse_arguments
from pipros.basics.printable import listed
from pipros_tools.cli.runner import only_argument, option_parser
from pipros_tools.cli.terminal import CYAN, table
from pipros_tools.graph.client import GraphClient
from pipros_tools.graph.services import (
    argument_names,
    nodes_by_service,
    service_class_of,
    services_of_type,
    type_of,
    uri_of,
)
from pipros_tools.graph.system_state import is_below


def list_services(argv: Sequence[str]) -> int:
    parser = option_parser("rosservice", "list [/namespace]")
    parser.add_option(
        "-n", "--nodes", dest="nodes", action="store_true", help="print nodes that provide service(s)"
    )
    options, arguments = parser.parse_args(list(parse_arguments(argv).rest))
    if len(arguments) > 1:
        parser.error("you may only specify one input namespace")
    with GraphClient("rosservice") as graph:
        ns = graph.resolve(arguments[0]) if arguments else "/"
        rows = [
            [listed(service), listed(node)] if options.nodes else [listed(service)]
            for service, node in sorted(nodes_by_service(graph.master).items())
            if is_below(service, ns)
        ]
    for line in table(rows, ("", CYAN) if options.nodes else ("",)):
        print(line)
    return 0


def show_type(argv: Sequence[str]) -> int:
    name = _one_service("type", argv)
    with GraphClient("rosservice") as graph:
        service = graph.resolve(name)
        type_name = type_of(graph.master, service)
    if type_name is None:
        print(f"Unknown service [{service}]", file=sys.stderr)
        return 1
    print(listed(type_name))
    return 0


def show_uri(argv: Sequence[str]) -> int:
    name = _one_service("uri", argv)
    with GraphClient("rosservice") as graph:
        service = graph.resolve(name)
        return _print_known(service, uri_of(graph.master, service))


def show_node(argv: Sequence[str]) -> int:
    name = _one_service("node", argv)
    with GraphClient("rosservice") as graph:
        service = graph.resolve(name)
        return _print_known(service, nodes_by_service(graph.master).get(service))


def _print_known(service: str, value: str | None) -> int:
    if value is None:
        print(f"Unknown service: {service}", file=sys.stderr)
        return 1
    print(listed(value))
    return 0


def show_args(argv: Sequence[str]) -> int:
    name = _one_service("args", argv)
    with GraphClient("rosservice") as graph:
        print(argument_names(service_class_of(graph.master, graph.resolve(name))))
    return 0


def _one_service(subcommand: str, argv: Sequence[str]) -> str:
    return only_argument(
        "rosservice",
        f"{subcommand} /service",
        argv,
        missing="service must be specified",
        several="you may only specify one input service",
    )


def show_info(argv: Sequence[str]) -> int:
    name = only_argument(
        "rosservice",
        "info /service",
        argv,
        missing="you must specify a service name",
        several="you may only specify one service",
    )
    with GraphClient("rosservice") as graph:
        service = graph.resolve(name)
        node = nodes_by_service(graph.master).get(service)
        if node is None:
            print("ERROR: unknown service", file=sys.stderr)
            return 1
        print(f"Node: {listed(node)}")
        print(f"URI: {listed(uri_of(graph.master, service))}")
        service_class = service_class_of(graph.master, service)
    print(f"Type: {service_class._type}")
    print(f"Args: {argument_names(service_class)}")
    return 0


def find_services(argv: Sequence[str]) -> int:
    type_name = only_argument(
        "rosservice",
        "find msg-type",
        argv,
        missing="please specify a message type",
        several="you may only specify one message type",
    )
    with GraphClient("rosservice") as graph:
        print("\n".join(map(listed, services_of_type(graph.master, type_name))))
    return 0
